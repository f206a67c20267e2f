// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/flight_tracks.hpp"

#include <utility>

namespace fbvins {

void FlightCollector::add(const TrackedFrame& frame) {
  std::vector<FlightView>& views = seen_[frame.id];
  for (const TrackedFeature& feature : frame.features)
    for (const Observation& o : feature.seen) {
      tracks_.untriggered = tracks_.untriggered || frame.offsets.are_apart(0, o.camera);
      views.push_back({feature.id, o.camera, o.pixel});
    }
}

void FlightCollector::add(const Keyframe& keyframe) {
  const GaugeState& g = keyframe.gauge;
  FlightKeyframe out;
  out.t = keyframe.t;
  out.state.T_FB = g.T_GB.cast_frames<W, B>();  // levelled in take()
  out.state.v_FB = g.v_GB;
  out.state.bias = keyframe.imu.bias;
  out.imu = keyframe.imu.segments;
  out.new_frame = resets_.empty() || resets_.back() != keyframe.reset_counter;
  if (const auto seen = seen_.find(keyframe.id); seen != seen_.end()) out.views = std::move(seen->second);
  seen_.erase(seen_.begin(), seen_.upper_bound(keyframe.id));
  tracks_.noise = keyframe.imu.noise;
  tracks_.gravity_mps2 = keyframe.imu.gravity_mps2;
  tracks_.keyframes.push_back(std::move(out));
  resets_.push_back(keyframe.reset_counter);
  q_LG_[keyframe.reset_counter] = g.q_LG;
}

FlightTracks FlightCollector::take() {
  for (std::size_t i = 0; i < tracks_.keyframes.size(); ++i) {
    NavState<W>& state = tracks_.keyframes[i].state;
    const Quat& q_LG = q_LG_[resets_[i]];
    state.T_FB = {(q_LG * state.T_FB.q).normalized(), Vec3(q_LG * state.T_FB.p)};
    state.v_FB = q_LG * state.v_FB;
  }
  resets_.clear(), q_LG_.clear(), seen_.clear();
  return std::exchange(tracks_, {});
}

}  // namespace fbvins
