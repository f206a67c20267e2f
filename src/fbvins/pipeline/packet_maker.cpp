// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/packet_maker.hpp"

namespace fbvins {

void PacketMaker::push(StereoFrame frame) {
  frame.t = frame.t + offset_;  // on the IMU's clock while it waits
  if (newest_image_ && frame.t <= *newest_image_) {
    ++backward_;
    return;
  }
  newest_image_ = frame.t;
  waiting_.push_back(std::move(frame));
}

std::optional<SensorPacket> PacketMaker::next(bool flush) {
  if (waiting_.empty()) return std::nullopt;
  const Time t = waiting_.front().t;
  const bool waited_long = (*newest_image_ - t).seconds() > options_.max_imu_wait_s;
  if (!imu_.covers(t) && !flush && !waited_long) return std::nullopt;
  SensorPacket packet;
  packet.id = FrameId{next_frame_++};
  packet.frame = std::move(waiting_.front());
  waiting_.pop_front();
  if (previous_image_) packet.imu = imu_.extract_now(*previous_image_, t);
  previous_image_ = t;
  // All later stages use the image's own clock.
  packet.frame.t = t - offset_;
  return packet;
}

InputCounts PacketMaker::counts() const { return {imu_.counts(), static_cast<int>(next_frame_), backward_}; }

}  // namespace fbvins
