// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/packet_maker.hpp"

#include <utility>

namespace fbvins {

void PacketMaker::push(StereoFrame frame) {
  if (newest_image_ && frame.t <= *newest_image_) {
    ++backward_;
    return;
  }
  newest_image_ = frame.t;
  waiting_.push_back(std::move(frame));
}

void PacketMaker::push(Anchor anchor) {
  constexpr std::size_t kMost = 1024;  // where no images come
  if (anchors_.size() >= kMost) anchors_.erase(anchors_.begin());
  anchors_.push_back(std::move(anchor));
}

std::optional<SensorPacket> PacketMaker::next(bool flush) {
  if (waiting_.empty()) return std::nullopt;
  const Time t = waiting_.front().t;
  const bool waited_long = (*newest_image_ - t).seconds() > options_.max_imu_wait_s;
  if (!imu_.covers(t) && !flush && !waited_long) return std::nullopt;
  SensorPacket packet;
  packet.id = FrameId{next_frame_++};
  packet.frame = std::move(waiting_.front());
  packet.anchors = std::exchange(anchors_, {});
  waiting_.pop_front();
  if (previous_image_) packet.imu = imu_.between(*previous_image_, t);
  imu_.forget_before(t);
  previous_image_ = t;
  return packet;
}

InputCounts PacketMaker::counts() const { return {imu_.counts(), static_cast<int>(next_frame_), backward_}; }

}  // namespace fbvins
