// SPDX-License-Identifier: Apache-2.0
// The calibration of sources that know none themselves. Any thread.
//
//   Result<StereoRig> rig = rig_for_source(options, "video devices", 4);
#pragma once

#include <string_view>

#include "fbvins/live/make_source.hpp"

namespace fbvins {

/// The calibration that the options bring (DatasetOptions::brings_rig): the rig, or that of Kalibr's files.
Result<StereoRig> given_rig(const DatasetOptions& dataset);

/// Of the calibration in the options; without one `options.uncalibrated`, with as many cameras. An error where there is neither,
/// or the calibration has another number of cameras; 0 cameras: any number. `what` names the sensors in sentences.
Result<StereoRig> rig_for_source(const SourceOptions& options, std::string_view what, int cameras);

/// The same for one camera and a depth sensor: registered to it where the calibration has one camera; of two cameras the second
/// is the depth sensor's, whose images are not registered.
Result<StereoRig> depth_rig_for_source(const SourceOptions& options, std::string_view what);

}  // namespace fbvins
