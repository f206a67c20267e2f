// SPDX-License-Identifier: Apache-2.0
// A rig as YAML that gives back the same bits, as flight records carry it. Kalibr's and EuRoC's files hold rotations as
// matrices, which do not. Pure functions, any thread.
#pragma once

#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

std::string rig_to_yaml(const StereoRig& rig);
/// `file` is only for messages.
Result<StereoRig> parse_rig(const std::string& text, const std::string& file);

}  // namespace fbvins
