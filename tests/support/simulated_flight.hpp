// SPDX-License-Identifier: Apache-2.0
// For tests: tracks and readings of an exactly known motion in a room of random points, without images.
// Sensors can be stopped or broken.
//
//   SimulatedFlight flight(test::Motion(0.5, 0.3), 1);
//   TrackedFrame frame = flight.frame(k);      // k = 0, 1, 2, ... in order
//   NavState<W> truth = flight.truth(k);
#pragma once

#include <functional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/types/tracking.hpp"
#include "tests/support/imu_test_motion.hpp"

namespace fbvins::test {

class SimulatedFlight {
 public:
  double pixel_sigma_px = 0.5;
  double image_rate_hz = 20;
  int max_features = 120;
  bool reobserves = false;  ///< a point that was out of view is re-observed as the same track
  ImuBias bias{Vec3(0.01, -0.02, 0.03), Vec3(0.05, 0.1, -0.08)};
  /// Whether frame k has images, a left one, a right one, readings; the defaults give all.
  std::function<bool(int)> images = [](int) { return true; };
  std::function<bool(int)> left_camera = [](int) { return true; };
  std::function<bool(int)> right_camera = [](int) { return true; };
  std::function<bool(int)> readings = [](int) { return true; };
  /// Turns an exact pixel displacement into an outlier; nullptr: none.
  std::function<Vec2(int, std::int64_t)> outlier = nullptr;
  /// Where a thing fills the view: its points are those of the room, moved by this, and other tracks. nullptr: never.
  std::function<std::optional<Vec3>(int)> thing = nullptr;
  /// With reobserves: whether point i, re-observed in frame k, is mistaken for point i - 1.
  std::function<bool(int, int)> mistaken = [](int, int) { return false; };

  SimulatedFlight(const Motion& motion, std::uint64_t seed) : motion_(motion), rng_(seed) {
    const Camera camera(PinholeRadtan{.fx = 450, .fy = 450, .cx = 376, .cy = 240}, 752, 480);
    const Mat3 R_BC = (Mat3() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();  // looks along the body's x
    rig.cameras = {{camera, {R_BC, Vec3(0.02, 0.055, 0.01)}}, {camera, {R_BC, Vec3(0.02, -0.055, 0.01)}}};
    for (int i = 0; i < 1500; ++i) {  // on the walls, floor and ceiling of a room of 8 x 8 x 4 m
      Vec3 p(rng_.uniform(-4, 4), rng_.uniform(-4, 4), rng_.uniform(-2, 2));
      const int axis = static_cast<int>(rng_.below(3));
      p(axis) = (axis == 2 ? 2 : 4) * (rng_.below(2) ? 1 : -1);
      points_.push_back(p);
    }
  }

  Time stamp(int k) const { return Time{1'000'000'000} + Duration::from_seconds(k / image_rate_hz); }
  template <class F = W>
  NavState<F> truth(int k) const {
    return motion_.state<F>(stamp(k).seconds(), bias);
  }
  const std::vector<Vec3>& points() const { return points_; }

  TrackedFrame frame(int k) {
    TrackedFrame out;
    out.id = FrameId{k};
    out.t = stamp(k);
    out.offsets = own_offsets(rig);
    out.set_has(0, images(k) && left_camera(k));
    out.set_has(1, images(k) && right_camera(k));
    if (k > 0 && readings(k)) {
      out.imu = motion_.segment(stamp(k - 1), out.t, Duration::from_seconds(1 / rig.imu_noise.rate_hz), bias);
      add_noise(out.imu, rig.imu_noise, rng_);
      if (last_sample_ && last_sample_->t == out.imu.samples.front().t) out.imu.samples.front() = *last_sample_;
      last_sample_ = out.imu.samples.back();
    }
    std::unordered_map<int, TrackId> still;
    if (images(k)) see(k, still, out);
    for (const auto& [point, track] : still) known_[point] = track;
    tracks_ = std::move(still);
    return out;
  }

  /// The frame of stamp(k) whose image was taken `late` before its stamp: readings up to the stamp, features from earlier.
  TrackedFrame frame_with_late_stamp(int k, Duration late) {
    late_ = late;
    return frame(k);
  }

  StereoRig rig;
  /// Of the images, beside the cameras' own times; the rig may be given another one.
  double line_delay_s = 0;

 private:
  /// The point in a camera at the time of the row that shows it.
  Vec3 in_camera(int k, const Vec3& p_W, int number) const {
    const auto& [camera, T_BC] = rig.mounted(number);
    const CameraTimes& own = camera.own_times();
    const double delay_s = line_delay_s + own.line_delay_s;
    double after_s = own.time_offset_s;
    Vec3 p_C = Vec3::Zero();
    for (int i = 0; i < (delay_s == 0 ? 1 : 4); ++i) {
      const Pose<W, B> T_WB = motion_.state((stamp(k) - late_).seconds() + after_s, bias).T_FB;
      p_C = T_BC.inverse() * (T_WB.inverse() * p_W);
      const auto px = p_C.z() > 0.2 ? camera.project(p_C) : std::nullopt;
      if (px) after_s = own.time_offset_s + (px->y() - 0.5 * camera.height()) * delay_s;
    }
    return p_C;
  }

  void see(int k, std::unordered_map<int, TrackId>& still, TrackedFrame& out) {
    const std::optional<Vec3> moved = thing ? thing(k) : std::nullopt;
    if (moved.has_value() != filled_) tracks_.clear(), known_.clear();
    filled_ = moved.has_value();
    const auto point = [&](int i) -> Vec3 { return points_[i] + moved.value_or(Vec3::Zero()); };
    std::unordered_set<TrackId> in_use;
    // Tracks that continue first, then new ones up to the limit.
    for (const bool followed : {true, false}) {
      for (int i = 0; i < static_cast<int>(points_.size()); ++i) {
        const auto track = tracks_.find(i);
        if ((track != tracks_.end()) != followed || static_cast<int>(out.features.size()) >= max_features) continue;
        const auto left = observe(rig.left(), in_camera(k, point(i), 0));
        if (!left) continue;
        TrackedFeature f;
        const auto known = known_.find(mistaken(k, i) ? i - 1 : i);
        if (followed) f.id = track->second;
        else if (reobserves && known != known_.end() && !in_use.contains(known->second)) f.id = known->second;
        else f.id = TrackId{next_track_++};
        in_use.insert(f.id);
        if (left_camera(k)) f.see(0, outlier ? shifted(*left, outlier(k, f.id.value)) : *left);
        if (right_camera(k)) f.see(1, observe(rig.right(), in_camera(k, point(i), 1)));
        if (f.seen.empty()) continue;
        out.stats.tracked += followed;
        out.stats.stereo += f.by_several();
        still[i] = f.id;
        out.features.push_back(f);
      }
    }
  }

  std::optional<Observation> observe(const Camera& camera, const Vec3& p_C) {
    if (p_C.z() < 0.2) return std::nullopt;
    const auto px = camera.project(p_C);
    if (!px || !camera.inside(*px, 4)) return std::nullopt;
    Observation o;
    o.pixel = *px + pixel_sigma_px * Vec2(rng_.normal(), rng_.normal());
    o.normalised = *camera.undistort(o.pixel);
    Mat2 J;
    (void)camera.distort(o.normalised, &J);
    o.sqrt_information = J / pixel_sigma_px;
    return o;
  }

  Observation shifted(Observation o, const Vec2& by_px) const {
    o.pixel += by_px;
    o.normalised = *rig.left().undistort(o.pixel);
    return o;
  }

  Motion motion_;
  Rng rng_;
  std::vector<Vec3> points_;
  std::unordered_map<int, TrackId> tracks_;  ///< point -> its present track
  std::unordered_map<int, TrackId> known_;   ///< point -> its last track
  std::int64_t next_track_ = 0;
  bool filled_ = false;  ///< by a thing
  std::optional<ImuSample> last_sample_;
  Duration late_;
};

}  // namespace fbvins::test
