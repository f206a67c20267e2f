// SPDX-License-Identifier: Apache-2.0
// Private: a bag as a recording of cameras without any calibration: ROS 1 and ROS 2 bags, MCAP files of ROS messages, flight
// records among them. One thread at a time.
//
//   Result<CameraRecording> recording = open_camera_bag("board.bag", {"/cam0/image_raw", "/cam1/image_raw", "/imu0"});
#pragma once

#include <string>
#include <vector>

#include "fbvins/io/camera_recording.hpp"

namespace fbvins {

/// A bag or flight record, by its name or content.
bool is_camera_bag(const std::string& path);

/// `topics`: those of the cameras, in their order, and of the IMU, if it is not the only one. None: all image topics by their
/// names, without depth images and those that are the same images compressed. The error lists the topics there are, where these
/// do not say which are meant.
Result<CameraRecording> open_camera_bag(const std::string& path, const std::vector<std::string>& topics);

}  // namespace fbvins
