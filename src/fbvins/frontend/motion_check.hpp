// SPDX-License-Identifier: Apache-2.0
// Finds tracks on moving objects. However many of them agree with one another, they disagree with the camera's motion that
// is predicted from the estimator's state and the IMU (docs/derivations/integrity.md). Small errors of the prediction are first
// corrected by the tracks.
// Buffers are reused; one instance, one thread.
//
//   MotionCheck check(camera, baseline_m);
//   check.collect(tracks, [](const Track& t) { return t.observed ? &t.previous_normalised : nullptr; });
//   check.judge(tracks, predictor.between(t_before, t_now), (t_now - t_before).seconds(), stats);  // those that move are lost
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "fbvins/frontend/prediction.hpp"
#include "fbvins/frontend/track_table.hpp"

namespace fbvins {

class MotionCheck {
 public:
  /// `baseline_m`: of the stereo pair by which depths are measured.
  MotionCheck(const Camera& camera, double baseline_m) : camera_(camera), baseline_m_(baseline_m) {}

  /// `before(track)`: pointer to the normalised position in the image before; null leaves the track out, as an unknown depth
  /// does.
  template <class Tracks, class Before>
  void collect(const Tracks& tracks, Before&& before) {
    chosen_.clear();
    points_.clear();
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      const Vec2* position = before(tracks[i]);
      if (position == nullptr || tracks[i].status != TrackStatus::active || !tracks[i].previous_inverse_depth) continue;
      chosen_.push_back(i);
      Point& point = points_.emplace_back(Point{*position, tracks[i].normalised, *tracks[i].previous_inverse_depth});
      camera_.distort(point.now, &point.J_pixel_normalised);
    }
  }

  /// Tracks on moving objects are lost. None where the motion has no translation, or agrees with too few tracks to be right.
  template <class Tracks>
  void judge(Tracks& tracks, const CameraMotion& predicted, double dt_s, FrontendStats& stats) {
    for (const std::size_t k : moving(predicted, dt_s)) {
      tracks[chosen_[k]].status = TrackStatus::lost;
      ++stats.lost_check;
    }
  }

 private:
  struct Point {
    Vec2 before, now;      // normalised
    double inverse_depth;  // before, 1/m
    Mat2 J_pixel_normalised = Mat2::Identity();
  };
  using Jacobian = Eigen::Matrix<double, 2, 6>;
  Vec2 residual_px(const CameraMotion& motion, const Point& point, Jacobian* J = nullptr) const;
  std::optional<CameraMotion> corrected(const CameraMotion& predicted, double dt_s) const;
  const std::vector<std::size_t>& moving(const CameraMotion& predicted, double dt_s);
  double noise_scale(const CameraMotion& motion) const;

  Camera camera_;
  double baseline_m_;
  std::vector<std::size_t> chosen_;  // tracks of points_
  std::vector<Point> points_;
  std::vector<std::size_t> moving_;  // points_ on moving objects
};

}  // namespace fbvins
