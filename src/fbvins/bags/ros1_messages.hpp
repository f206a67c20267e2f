// SPDX-License-Identifier: Apache-2.0
// Private to bags: messages of ROS 1, byte by byte, and the topics that a bag of a rig has. Pure functions.
//
//   std::string bytes = ros1::imu_message(sample);        // sensor_msgs/Imu
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/aiding.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins::ros1 {

struct Topic {
  std::string name;
  const char *type, *checksum;
  std::string definition;
};

/// The topics' numbers: their places in topics().
enum Number : std::uint32_t {
  kImu,
  kLeft,
  kRight,
  kLeftInfo,
  kRightInfo,
  kTransforms,
  kRig,
  kTruth,
  kOdometry,
  kFurther,           ///< image and camera_info of each camera from number 2 on
  kDepth = kFurther,  ///< of a rig with one camera
  kDepthInfo          ///< of a depth sensor with a lens of its own
};

std::uint32_t image_number(int camera);
std::uint32_t info_number(int camera);
std::vector<Topic> topics(const StereoRig& rig);

inline constexpr std::int64_t kSecond_ns = 1'000'000'000;
/// Seconds and nanoseconds, 32 bits each.
std::uint64_t ros_time(Time t);

/// Of an aiding sensor.
Topic aiding_topic(const std::string& name, const AidingSample& reading);
/// Of a frame of the body's.
std::string transform_message(Time t, std::string_view frame, const Pose<B, B>& T_BS);
std::string imu_message(const ImuSample& sample);
std::string image_message(Time t, std::string_view frame, const Image& image);
std::string depth_message(Time t, std::string_view frame, const DepthImage& depth);
std::string camera_message(Time t, std::string_view frame, const Camera& camera);
std::string transforms_message(Time t, const StereoRig& rig);
std::string text_message(std::string_view text);
std::string pose_message(Time t, std::string_view frame, const Pose<W, B>& T_WB);

}  // namespace fbvins::ros1
