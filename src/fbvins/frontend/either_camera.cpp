// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/either_camera.hpp"

#include <utility>

#include "fbvins/frontend/frame_images.hpp"

namespace fbvins {
namespace {

SensorPacket mirrored(SensorPacket packet) {
  packet.frame.swap_left_right();
  const ExposureOffsets offsets = packet.frame.offsets;
  packet.frame.offsets.set(0, offsets.of(1));
  packet.frame.offsets.set(1, offsets.of(0));
  return packet;
}

TrackedFrame mirrored(TrackedFrame frame) {
  for (TrackedFeature& feature : frame.features) {
    const auto seen = std::exchange(feature.seen, {});
    for (const Observation& o : seen) feature.see(1 - o.camera, o);
  }
  frame.cameras = {frame.has(1), frame.has(0)};
  std::swap(frame.stats.mean_brightness_left, frame.stats.mean_brightness_right);
  return frame;
}

}  // namespace

StereoRig mirrored(const StereoRig& rig) {
  StereoRig out = rig;
  std::swap(out.cameras[0], out.cameras[1]);
  return out;
}

EitherCamera::EitherCamera(const StereoRig& rig, std::unique_ptr<LeadingFrontend> left, std::unique_ptr<LeadingFrontend> right)
    : left_camera_(rig.left()), right_camera_(rig.right()), left_(std::move(left)), right_(std::move(right)) {}

TrackedFrame EitherCamera::process(const SensorPacket& packet, const StatePrior& prior) {
  choose(packet.frame);
  if (!right_leads_) {
    right_->stand_by(packet, prior);
    return left_->process(packet, prior);
  }
  left_->stand_by(packet, prior);
  TrackedFrame out = mirrored(right_->process(mirrored(packet), prior));
  if (out.has(0)) lead_with(false);  // from the next image on: both cameras saw this one
  return out;
}

/// The camera whose image did not come cannot lead.
void EitherCamera::choose(const StereoFrame& frame) {
  const bool left = is_usable(frame.left().get(), left_camera_), right = is_usable(frame.right().get(), right_camera_);
  if (!right_leads_) {
    if (!left && right) lead_with(true);
  } else if (left && left_->reaches(frame.t)) {
    right_leads_ = false;
    left_->begin_ids_at(right_->next_id());
  } else if (left && !right) {
    lead_with(false);
  }
}

void EitherCamera::lead_with(bool right) {
  right_leads_ = right;
  if (right) right_->take_over(left_->hand_over());
  else left_->take_over(right_->hand_over());
}

void EitherCamera::locate(const LandmarkUpdate& update) {
  left_->locate(update);
  right_->locate(update);
}

}  // namespace fbvins
