// SPDX-License-Identifier: Apache-2.0
// Private to bags: whether images are raw or rectified, where camera_info describes both. The names of their topics say so, and
// the images of a pair where they contradict the names: features are found along the epipolar lines of the right lenses alone.
//
//   judge_rectified(contents, topics, "", recording);
#pragma once

#include <string>

#include "fbvins/bags/bag_contents.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins {

/// Changes recording.rig where images contradict the names, and adds a warning of what is used where names or images made a
/// difference. `given`: as rig_of() has it. recording.loader delivers its frames.
void judge_rectified(BagContents& contents, const ChosenTopics& topics, const std::string& given, DatasetContents& recording);

}  // namespace fbvins
