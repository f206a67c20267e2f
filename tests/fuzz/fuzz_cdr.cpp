// SPDX-License-Identifier: Apache-2.0
// ROS 2's messages as they come over the network or from a record, as a fuzz target.
#include "fbvins/io/ros_messages.hpp"
#include "tests/fuzz/fuzz_targets.hpp"
#include "tests/fuzz/require.hpp"

namespace fbvins::fuzz {

std::vector<std::string> cdr_seeds() {
  std::vector<std::string> out(4);
  const Image image(8, 6, std::uint8_t{7});
  append_imu(out[0], ImuSample{Time{1000}, Vec3(1, 2, 3), Vec3(0, 0, 9.81)}, {});
  append_image(out[1], Time{1000}, "left", &image);
  append_image(out[2], Time{1000}, "left", nullptr);
  RosOdometry odometry;
  odometry.t = Time{1000};
  append_odometry(out[3], odometry);
  return out;
}

/// The bytes as each type of message that is read. A grey image has the pixels that its size promises.
void fuzz_cdr(std::string_view bytes) {
  if (const auto sample = read_imu(bytes)) require(sample->t.ns >= 0 && sample->t < ros_time_end());
  for (const auto& pose : {read_pose(bytes), read_odometry(bytes)})
    if (pose) require(pose->t.ns >= 0 && pose->t < ros_time_end());
  const auto image = read_image(bytes);
  if (!image || !image->is_grey() || image->empty()) return;
  require(image->step >= image->width && image->pixels.size() >= std::uint64_t{image->step} * image->height);
  require(image->pixels.data() >= bytes.data() && image->pixels.data() + image->pixels.size() <= bytes.data() + bytes.size());
}

}  // namespace fbvins::fuzz
