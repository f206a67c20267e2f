// SPDX-License-Identifier: Apache-2.0
// A rig as YAML that gives back the same bits, as flight records carry it. Kalibr's and EuRoC's files hold rotations as
// matrices, which do not. Pure functions, any thread.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

/// On which bags carry it.
inline constexpr std::string_view kRigTopic = "/fbvins/calibration";

/// `topics`: of the images of each camera, where the text is to say it.
std::string rig_to_yaml(const StereoRig& rig, const std::vector<std::string>& topics = {});
/// The same text with the topics of a bag; `text` is of rig_to_yaml().
std::string with_topics(const std::string& text, const std::vector<std::string>& topics);
/// Those that the text says; empty without.
std::vector<std::string> topics_in(const std::string& text);
/// `file` is only for messages.
Result<StereoRig> parse_rig(const std::string& text, const std::string& file);

}  // namespace fbvins
