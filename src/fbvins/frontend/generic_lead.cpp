// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/generic_lead.hpp"

#include <algorithm>
#include <utility>

#include "fbvins/frontend/frame_images.hpp"
#include "fbvins/frontend/klt_options.hpp"

namespace fbvins {
namespace {

/// Between images whose features are followed on, as in klt.
const double kLongestGap_s = KltFrontendOptions{}.max_gap_s;

}  // namespace

GenericLead::GenericLead(const StereoRig& rig, FrontendOfPair make) : rig_(rig), make_(std::move(make)) { begin_anew(); }

void GenericLead::begin_anew() {
  frontend_ = make_(rig_);
  if (most_ > 0) frontend_->follow_at_most(most_);
  next_own_ = 0;
  numberings_ = {{0, next_id_}};
}

TrackId GenericLead::outside(TrackId own) const {
  auto n = numberings_.rbegin();
  while (n != numberings_.rend() - 1 && own.value < n->own) ++n;
  return TrackId{n->outside + own.value - n->own};
}

std::optional<TrackId> GenericLead::own(TrackId outside) const {
  std::int64_t end = next_own_;
  for (auto n = numberings_.rbegin(); n != numberings_.rend(); end = n->own, ++n)
    if (const std::int64_t at = n->own + outside.value - n->outside; at >= n->own && at < end) return TrackId{at};
  return std::nullopt;
}

bool GenericLead::is_usable_feature(const TrackedFeature& feature) const {
  const auto is_usable = [this](const Observation& o) {
    return (o.camera == 0 || o.camera == 1) && o.pixel.allFinite() && o.normalised.allFinite() &&
           o.sqrt_information.allFinite() && !rig_.camera(o.camera).hidden(o.pixel, 0);
  };
  return !feature.seen.empty() && std::ranges::all_of(feature.seen, is_usable);
}

TrackedFrame GenericLead::process(const SensorPacket& packet, const StatePrior& prior) {
  TrackedFrame out = frontend_->process(packet, prior);
  out.set_has(0, is_usable(packet.frame.left().get(), rig_.left()));
  if (!rig_.depth) out.set_has(1, rig_.has_right() && is_usable(packet.frame.right().get(), rig_.right()));
  std::erase_if(out.features, [this](const TrackedFeature& feature) { return !is_usable_feature(feature); });
  for (TrackedFeature& feature : out.features) {
    next_own_ = std::max(next_own_, feature.id.value + 1);
    feature.id = outside(feature.id);
    next_id_ = std::max(next_id_, feature.id.value + 1);
  }
  newest_ = packet.frame.t;
  return out;
}

void GenericLead::locate(const LandmarkUpdate& update) {
  LandmarkUpdate own{update.sequence, update.reset_counter, {}};
  for (LocatedLandmark landmark : update.landmarks) {
    const std::optional<TrackId> track = this->own(landmark.track);
    if (!track) continue;
    landmark.track = *track;
    own.landmarks.push_back(landmark);
  }
  frontend_->locate(own);
}

void GenericLead::follow_at_most(int features) {
  most_ = features;
  frontend_->follow_at_most(features);
}

bool GenericLead::reaches(Time t) const { return t >= newest_ && (t - newest_).seconds() <= kLongestGap_s; }

void GenericLead::begin_ids_at(std::int64_t id) {
  if (id <= next_id_) return;
  next_id_ = id;
  numberings_.push_back({next_own_, next_id_});
}

TrackTransfer GenericLead::hand_over() {
  TrackTransfer out;
  out.next_id = next_id_;
  return out;
}

void GenericLead::take_over(TrackTransfer handover) {
  next_id_ = std::max(next_id_, handover.next_id);
  begin_anew();
}

}  // namespace fbvins
