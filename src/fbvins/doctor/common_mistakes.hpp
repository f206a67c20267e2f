// SPDX-License-Identifier: Apache-2.0
// Private to the doctor: mistakes that are made often and have no size, each as the calibration without it. One of them explains
// at once what looks like several wrong figures. Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "fbvins/doctor/doctor.hpp"

namespace fbvins {

/// How the images as they are recorded become those that a mistake's calibration is of.
enum class ImageFlip { none, left_right, top_bottom };
enum class FlippedCameras { both, left, right };

struct CommonMistake {
  FindingKind kind = FindingKind::extrinsics_inverted;
  std::string what;    ///< "with ..., the calibration explains the recording"
  std::string advice;  ///< as in Finding
  StereoRig rig;       ///< the calibration without it
  ImageFlip flip = ImageFlip::none;
  std::vector<CalibrationField> fields = {};  ///< empty: no calibration corrects it
  /// Rotation in images with that flip, in the axes of `rig`'s C0: that of a mirror image goes about other axes.
  Mat3 seen_as = Mat3::Identity();
  FlippedCameras flipped = FlippedCameras::both;
};

/// All of them, common ones first.
std::vector<CommonMistake> common_mistakes(const StereoRig& rig);

/// Whether what was found with the calibration as given may come from a common mistake: something is very wrong.
bool is_strange(const Diagnosis& as_given);

/// Whether one view of the evidence as given, and the mounting found with it, speak for a mistake: cheap, before all is
/// examined.
bool may_be(const CommonMistake& mistake, const Evidence& evidence, const Diagnosis& as_given);

/// What a diagnosis takes to explain the recording: one for each cause, one for each figure that it leaves open, and two for each
/// point that cannot be judged.
int cost_of(const Diagnosis& diagnosis);

}  // namespace fbvins
