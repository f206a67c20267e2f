// SPDX-License-Identifier: Apache-2.0
// Tracks as a frontend would give them of a flight through a synthetic room, without images: corners on its walls, seen
// by both cameras with the errors that tracks have: noise, a slow drift of each, and a fast drift of some. A corner
// that comes back into view may be re-observed if it is close to where the estimator's pose predicts it.
// One instance for each flight; the same seed gives the same bytes.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/simulation.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins::bench {

struct TrackOptions {
  int features = 150;
  bool recognise = false;
  double noise_px = 0.4;
  double slide_px = 0.04;     ///< drift of a track in a frame, standard deviation
  double bad_share = 0.02;    ///< share of tracks that drift ten times as fast
  double lost_share = 0.02;   ///< share of the tracks that end in a frame
  double known_share = 0.15;  ///< of the corners that could be re-observed in a frame, the share that is
  double sigma_px = 0.6;      ///< standard deviation that the estimator assumes
  double lap_s = 0;           ///< the flight is flown again and again, once in this time; 0: once
  std::uint64_t seed = 1;
};

class SyntheticTracks {
 public:
  SyntheticTracks(const Simulation& flight, const TrackOptions& options) : flight_(flight), o_(options), rng_(options.seed, 77) {
    Vec3 low = Vec3::Constant(1e9), high = -low;
    for (double t = 0; t < flight.flight.duration_s(); t += 0.1) {
      low = low.cwiseMin(flight.flight.pose(t).p);
      high = high.cwiseMax(flight.flight.pose(t).p);
    }
    low -= Vec3(2.5, 2.5, 1.2);
    high += Vec3(2.5, 2.5, 1.2);
    const int corners = static_cast<int>(60 * (high - low).head<2>().prod());
    for (int i = 0; i < std::clamp(corners, 2500, 9000); ++i) {
      Vec3 c;
      for (int k = 0; k < 3; ++k) c(k) = rng_.uniform(low(k), high(k));
      if (rng_.uniform() < 0.75) {  // the others are objects in the room, near its walls
        const int axis = static_cast<int>(rng_.below(3));
        c(axis) = rng_.below(2) ? low(axis) : high(axis);
      } else {
        const int axis = static_cast<int>(rng_.below(2));
        c(axis) = rng_.below(2) ? low(axis) + rng_.uniform(0, 1.5) : high(axis) - rng_.uniform(0, 1.5);
      }
      corners_.push_back(c);
    }
  }

  void locate(const LandmarkUpdate& update) {
    for (const LocatedLandmark& l : update.landmarks) located_[l.track] = l.p_G;
    if (located_.size() > 4 * corners_.size()) forget_ended_tracks();
  }

  /// No track goes on.
  void lose_all() {
    for (auto& [corner, track] : tracks_) track.followed = false;
  }

  /// At any stamp, in order, without IMU readings; the right image taken at `right_t`. `prior` is the estimator's, of some image
  /// before.
  TrackedFrame frame_at(FrameId id, Time t, const StatePrior& prior) { return frame_at(id, t, prior, t); }
  TrackedFrame frame_at(FrameId id, Time t, const StatePrior& prior, Time right_t) {
    TrackedFrame out;
    out.id = id;
    out.t = t;
    out.cameras = {true, true};
    const double t_s = (out.t - flight_.start).seconds();
    const Pose<W, B> T_WB = pose(t_s);
    // The drift of G at the prior's own time shifts the predicted positions.
    Pose<G, W> drift;
    if (prior.valid) {
      const Pose<W, B> then = pose((prior.t - flight_.start).seconds());
      drift = prior.T_GB * then.inverse();
    }
    motion_px_.clear();
    const Pose<W, B> right_T_WB = right_t == t ? T_WB : pose((right_t - flight_.start).seconds());
    see({T_WB.p, (T_WB * flight_.rig.T_BC0()).inverse(), (right_T_WB * flight_.rig.T_BC1()).inverse()},
        prior.valid ? &drift : nullptr, out);
    std::sort(motion_px_.begin(), motion_px_.end());
    if (!motion_px_.empty()) out.stats.median_motion_px = motion_px_[motion_px_.size() / 2];
    return out;
  }

 private:
  struct Track {
    TrackId id;
    Vec2 slide = Vec2::Zero(), step = Vec2::Zero();
    Vec2 seen_at = Vec2::Zero();
    Vec3 from = Vec3::Zero();  // where the body was when it was last seen
    int age = 0;
    bool followed = false;
  };

  Pose<W, B> pose(double t_s) const { return flight_.flight.pose(o_.lap_s > 0 ? std::fmod(t_s, o_.lap_s) : t_s); }

  /// A corner has one track at a time; the ended ones never come back under their old id.
  void forget_ended_tracks() {
    std::map<TrackId, Vec3> kept;
    for (const auto& [corner, track] : tracks_)
      if (const auto known = located_.find(track.id); known != located_.end()) kept.insert(*known);
    located_ = std::move(kept);
  }

  std::optional<Observation> observe(const Camera& camera, const Vec3& p_C, const Vec2& slide) {
    if (p_C.z() < 0.3) return std::nullopt;
    const auto px = camera.project(p_C);
    if (!px || !camera.inside(*px, 16)) return std::nullopt;
    Observation o;
    o.pixel = *px + slide + o_.noise_px * Vec2(rng_.normal(), rng_.normal());
    const auto ray = camera.undistort(o.pixel);
    if (!ray) return std::nullopt;
    o.normalised = *ray;
    Mat2 J;
    (void)camera.distort(o.normalised, &J);
    o.sqrt_information = J / o_.sigma_px;
    return o;
  }

  /// Whether an earlier track is re-observed, under its old id.
  bool known_again(const Track& track, const Vec3& p_W, const Vec3& body, const Pose<G, W>* drift) {
    if (!o_.recognise || drift == nullptr || track.age < 4) return false;
    const auto known = located_.find(track.id);
    if (known == located_.end() || rng_.uniform() > o_.known_share) return false;
    const Vec3 now = p_W - body, then = p_W - track.from;
    if (now.dot(then) < 0.82 * now.norm() * then.norm()) return false;
    if (now.norm() < 0.6 * then.norm() || then.norm() < 0.6 * now.norm()) return false;
    return ((*drift) * p_W - known->second).norm() * 458 / now.norm() < 15;  // within the search
  }

  /// One instant of the cameras.
  struct Instant {
    Vec3 body_W;
    Pose<C0, W> T_C0W;
    Pose<C1, W> T_C1W;
  };

  void add(Track& track, const Observation& left, const Vec3& p_W, const Instant& now, TrackedFrame& out) {
    TrackedFeature f;
    f.id = track.id;
    f.age_frames = track.age;
    f.see(0, left);
    if (rng_.uniform() < 0.9) f.see(1, observe(flight_.rig.right(), now.T_C1W * p_W, track.slide));
    out.stats.tracked += track.age > 0;
    out.stats.stereo += f.by_several();
    if (track.age > 0) motion_px_.push_back((left.pixel - track.seen_at).norm());
    track.seen_at = left.pixel;
    ++track.age;
    track.from = now.body_W;
    track.followed = true;
    out.features.push_back(f);
  }

  bool in_view(const Vec3& p_W, const Instant& now) const {
    const Vec3 p_C = now.T_C0W * p_W;
    return p_C.z() >= 0.3 && p_C.z() <= 30 && std::abs(p_C.x()) <= p_C.z() && std::abs(p_C.y()) <= 0.7 * p_C.z();
  }

  void follow(Track& track, const Vec3& p_W, const Instant& now, TrackedFrame& out) {
    track.slide += track.step + o_.slide_px * Vec2(rng_.normal(), rng_.normal());
    const auto left = observe(flight_.rig.left(), now.T_C0W * p_W, track.slide);
    if (left && track.slide.norm() < 8) add(track, *left, p_W, now, out);
    else track.followed = false;
  }

  void recognise(Track& track, const Vec3& p_W, const Instant& now, TrackedFrame& out) {
    track.slide = 0.3 * Vec2(rng_.normal(), rng_.normal());
    const auto left = observe(flight_.rig.left(), now.T_C0W * p_W, track.slide);
    if (!left) return;
    add(track, *left, p_W, now, out);
    ++out.stats.recognised;
  }

  bool full(const TrackedFrame& out) const { return static_cast<int>(out.features.size()) >= o_.features; }

  /// New tracks at some of these corners.
  void start(std::vector<std::size_t> corners, const Instant& now, TrackedFrame& out) {
    while (!full(out) && !corners.empty()) {
      const auto n = static_cast<std::size_t>(rng_.below(static_cast<std::uint32_t>(corners.size())));
      const std::size_t i = corners[n];
      corners[n] = corners.back();
      corners.pop_back();
      const Vec3 p_W = corners_[i];
      const auto left = observe(flight_.rig.left(), now.T_C0W * p_W, Vec2::Zero());
      if (!left) continue;
      Track track;
      track.id = TrackId{next_track_++};
      if (rng_.uniform() < o_.bad_share) track.step = 10 * o_.slide_px * Vec2(rng_.normal(), rng_.normal());
      add(tracks_[i] = track, *left, p_W, now, out);
    }
  }

  void see(const Instant& now, const Pose<G, W>* drift, TrackedFrame& out) {
    std::vector<std::size_t> fresh;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const Vec3 p_W = corners_[i];
      const auto it = tracks_.find(i);
      const bool followed = it != tracks_.end() && it->second.followed;
      if (!in_view(p_W, now)) {
        if (followed) it->second.followed = false;
        continue;
      }
      if (followed && rng_.uniform() > o_.lost_share) {
        follow(it->second, p_W, now, out);
        continue;
      }
      if (followed) it->second.followed = false;
      if (it != tracks_.end() && !full(out) && known_again(it->second, p_W, now.body_W, drift))
        recognise(it->second, p_W, now, out);
      else fresh.push_back(i);
    }
    start(std::move(fresh), now, out);
  }

  const Simulation& flight_;
  TrackOptions o_;
  Rng rng_;
  std::vector<Vec3> corners_;
  std::map<std::size_t, Track> tracks_;  // of each corner, the last
  std::map<TrackId, Vec3> located_;
  std::vector<double> motion_px_;
  std::int64_t next_track_ = 0;
};

}  // namespace fbvins::bench
