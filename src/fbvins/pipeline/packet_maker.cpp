// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/packet_maker.hpp"

#include <utility>

namespace fbvins {
namespace {

/// An image is processed without its readings once newer images are ahead by this.
constexpr double kMostImuWait_s = 0.25;

/// Readings that a correction of the time offset may need again.
constexpr Duration kMostCorrection{100'000'000};

/// An older one has come late, or images were missing: the motion since is too long.
constexpr Duration kOldestAiding{150'000'000};

}  // namespace

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

void PacketMaker::push(const AidingSample& reading) {
  constexpr std::size_t kMost = 1024;  // where no images come
  if (aiding_.size() >= kMost) aiding_.pop_front();
  aiding_.push_back(reading);
}

bool PacketMaker::is_ready(bool flush) const {
  if (waiting_.empty()) return false;
  const Time t = waiting_.front().t;
  const bool waited_long = (*newest_image_ - t).seconds() > kMostImuWait_s;
  return imu_.covers(t) || flush || waited_long;
}

std::optional<FrameId> PacketMaker::next_id(bool flush) const {
  return is_ready(flush) ? std::optional(FrameId{next_frame_}) : std::nullopt;
}

void PacketMaker::correct_time_offset(Duration by) {
  const Duration now = given_ + by;
  if (previous_) previous_ = *previous_ + (time_offset_ - now);
  imu_.set_time_offset(now);
  time_offset_ = now;
}

std::optional<SensorPacket> PacketMaker::next(bool flush) {
  SensorPacket packet;
  Time t;
  do {
    if (!is_ready(flush)) return std::nullopt;
    t = waiting_.front().t;
    packet.frame = std::move(waiting_.front());
    waiting_.pop_front();
    if (previous_) packet.imu = imu_.between(*previous_, t);
  } while (!repeated_.take_out(packet.frame, packet.imu));
  packet.imu.time_offset = time_offset_;
  packet.id = FrameId{next_frame_++};
  packet.anchors = std::exchange(anchors_, {});
  std::erase_if(aiding_, [&](const AidingSample& reading) {
    if (stamp_of(reading) > t) return false;
    if (t - stamp_of(reading) < kOldestAiding) packet.aiding.push_back(reading);
    return true;
  });
  imu_.forget_before(t - kMostCorrection);
  previous_ = t;
  return packet;
}

InputCounts PacketMaker::counts() const { return {imu_.counts(), static_cast<int>(next_frame_), backward_, repeated_.count()}; }

}  // namespace fbvins
