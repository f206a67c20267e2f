// SPDX-License-Identifier: Apache-2.0
// Private: a recording of one or more cameras as a ROS 1 bag, format 2.0, uncompressed, with its index. One thread.
//
//   Result<Ros1BagWriter> bag = Ros1BagWriter::create("flight.bag", rig, first_stamp);
//   bag->add(sample); bag->add(frame);
//   Result<void> done = bag->finish();          // the file appears here
#pragma once

#include <map>
#include <memory>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/io/rig_text.hpp"
#include "fbvins/types/aiding.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

inline constexpr std::string_view kBagTruthTopic = "/ground_truth", kBagOdometryTopic = "/odometry";
/// The image topics that the calibration on kRigTopic is of where its text names none: "/cam0/image_raw".
std::string bag_camera_topic(int camera);
inline constexpr std::string_view kBagDepthTopic = "/depth0/image_raw";

class Ros1BagWriter {
 public:
  /// With camera_info and /tf_static of the rig at `start`, and all of it as text (rig_text.hpp) on kRigTopic. `names`: topics
  /// that get another name.
  static Result<Ros1BagWriter> create(const std::string& path, const StereoRig& rig, Time start,
                                      const std::map<std::string, std::string>& names = {});
  ~Ros1BagWriter();
  Ros1BagWriter(Ros1BagWriter&&) noexcept;
  Ros1BagWriter& operator=(Ros1BagWriter&&) noexcept;

  // An error for a stamp that ROS cannot hold (before 1970, after 2106), or where the disk is full.
  Result<void> add(const ImuSample& sample);
  Result<void> add(const StereoFrame& frame);
  /// Its stamp is of the images' clock, and written on the IMU's.
  Result<void> add(const AidingSample& reading);
  /// On kBagTruthTopic.
  Result<void> add_truth(Time t, const Pose<W, B>& T_WB);
  /// On kBagOdometryTopic.
  Result<void> add_odometry(Time t, const Pose<W, B>& T_WB);
  Result<void> finish();

 private:
  struct State;
  explicit Ros1BagWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace fbvins
