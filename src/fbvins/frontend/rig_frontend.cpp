// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/rig_frontend.hpp"

#include <utility>

#include "fbvins/camera/group_images.hpp"

namespace fbvins {
namespace {

SensorPacket of_group(const SensorPacket& packet, const CameraGroup& group) {
  return {packet.id, images_of(packet.frame, group), packet.imu};
}

/// Sums; brightness and motion are those of the group with the most tracks.
void add(FrontendStats& sum, const FrontendStats& of_group) {
  if (of_group.tracked > sum.tracked || sum.mean_brightness_left == 0) {
    sum.mean_brightness_left = of_group.mean_brightness_left;
    sum.mean_brightness_right = of_group.mean_brightness_right;
    sum.median_motion_px = of_group.median_motion_px;
  }
  for (auto count :
       {&FrontendStats::tracked, &FrontendStats::detected, &FrontendStats::stereo, &FrontendStats::lost_flow,
        &FrontendStats::lost_check, &FrontendStats::lost_epipolar, &FrontendStats::expected, &FrontendStats::recognised})
    sum.*count += of_group.*count;
  for (auto time : {&FrontendStats::pyramid_ms, &FrontendStats::track_ms, &FrontendStats::stereo_ms, &FrontendStats::detect_ms,
                    &FrontendStats::geometry_ms, &FrontendStats::boost_ms})
    sum.*time += of_group.*time;
  sum.matches += of_group.matches;
  sum.raw_matches += of_group.raw_matches;
}

}  // namespace

RigFrontend::RigFrontend(std::vector<CameraGroup> groups, std::vector<std::unique_ptr<Frontend>> frontends, int max_features)
    : groups_(std::move(groups)), frontends_(std::move(frontends)), budget_(max_features, groups_.size()) {}

TrackId RigFrontend::rig_wide(TrackId id, std::size_t group) const {
  return TrackId{id.value * static_cast<std::int64_t>(groups_.size()) + static_cast<std::int64_t>(group)};
}

TrackedFrame RigFrontend::process(const SensorPacket& packet, const StatePrior& prior) {
  TrackedFrame out;
  out.id = packet.id;
  out.t = packet.frame.t;
  out.imu = packet.imu;
  for (std::size_t k = 0; k < groups_.size(); ++k) {
    frontends_[k]->follow_at_most(budget_.of(k));
    TrackedFrame frame = frontends_[k]->process(of_group(packet, groups_[k]), prior);
    budget_.note(k, static_cast<int>(frame.features.size()));
    out.set_has(groups_[k].first, frame.has(0));
    if (groups_[k].second) out.set_has(*groups_[k].second, frame.has(1));
    take_features(std::move(frame.features), k, out.features);
    add(out.stats, frame.stats);
  }
  return out;
}

void RigFrontend::take_features(std::vector<TrackedFeature> features, std::size_t group, std::vector<TrackedFeature>& out) const {
  for (TrackedFeature& feature : features) {
    feature.id = rig_wide(feature.id, group);
    feature.lead = groups_[group].first;
    for (Observation& o : feature.seen)
      o.camera = o.camera == 0 ? groups_[group].first : groups_[group].second.value_or(o.camera);
    out.push_back(std::move(feature));
  }
}

void RigFrontend::locate(const LandmarkUpdate& update) {
  const auto groups = static_cast<std::int64_t>(groups_.size());
  for (std::int64_t k = 0; k < groups; ++k) {
    LandmarkUpdate of_group{update.sequence, update.reset_counter, {}};
    for (LocatedLandmark landmark : update.landmarks) {
      if (landmark.track.value % groups != k) continue;
      landmark.track = TrackId{landmark.track.value / groups};
      of_group.landmarks.push_back(landmark);
    }
    frontends_[static_cast<std::size_t>(k)]->locate(of_group);
  }
}

}  // namespace fbvins
