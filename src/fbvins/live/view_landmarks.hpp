// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "fbvins/io/ros_messages.hpp"
#include "fbvins/live/live_event.hpp"

namespace fbvins {

/// Features and landmarks of a view as points of a ROS message, with those of the same track as one. Pixels are those of camera
/// 0: the message has no number of a camera.
std::vector<RosLandmark> landmarks_of(const LiveView& view);

}  // namespace fbvins
