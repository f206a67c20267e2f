// SPDX-License-Identifier: Apache-2.0
// Private: which camera of a Kalibr chain is which of a recording, by `rostopic`. Any thread.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

/// The `rostopic` of each camera of a chain; empty where the file cannot be read, or one has none.
std::vector<std::string> rostopics_of(const std::string& camchain_path);

/// Whether a `rostopic` is that of a recorded camera, by its topic or by the name of its folder (cam0).
bool names_camera(std::string_view rostopic, std::string_view recorded);

/// For each recorded camera, by its topic or by the name of its folder (cam0), the number of the chain's camera; empty where the
/// topics do not name all of them, or say what the numbers say.
std::vector<int> order_by_topics(const std::vector<std::string>& rostopics, const std::vector<std::string>& recorded);

/// The cameras in that order, the others behind.
StereoRig in_order(const StereoRig& rig, const std::vector<int>& order);

/// "cameras are matched by their rostopic: cam1 of chain.yaml is camera 0, ...".
std::string order_sentence(const std::string& camchain_path, const std::vector<int>& order);

}  // namespace fbvins
