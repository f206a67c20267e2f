// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/floor_scale.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/estimator/window_equations.hpp"
#include "fbvins/estimator/window_views.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

/// A scale that is farther off is not one that a start accepts.
constexpr double kMostOff = 0.2;
/// Landmarks of one floor are within this of its height, as a share of that. A wider group takes in what lies on the floor.
constexpr double kFlat = 0.015;
constexpr std::size_t kFewest = 12;
/// Farther away, as a share of the height, a landmark's height depends on the tilt more than on its depth.
constexpr double kFarthest = 4;
/// What the tilt, an uneven floor and landmarks that are seen again in the next keyframe leave.
constexpr double kScaleSigma = 0.03;
/// Landmarks of fewer frames have no depth to rely on.
constexpr int kFewestFrames = 4;
/// Lower, the floor's unevenness is too large a share of the height.
constexpr double kLeastDrop_m = 1;
/// Nearer to one another keyframes show no scale.
constexpr double kLeastBaseline_m = 0.1;

}  // namespace

std::optional<FloorScale> floor_scale(const std::vector<Vec3>& landmarks_G, const Vec3& p_G, const Vec3& up_G, double drop_m) {
  std::vector<double> ratios;
  for (const Vec3& l : landmarks_G) {
    const Vec3 away = l - p_G;
    const double below = -up_G.dot(away), beside = (away + below * up_G).norm();
    if (std::abs(below / drop_m - 1) < kMostOff && beside < kFarthest * drop_m) ratios.push_back(below / drop_m);
  }
  std::sort(ratios.begin(), ratios.end());
  // The densest group: most landmarks within the width.
  std::size_t first = 0, most = 0;
  for (std::size_t i = 0, j = 0; i < ratios.size(); ++i) {
    while (j < ratios.size() && ratios[j] <= ratios[i] + 2 * kFlat) ++j;
    if (j - i > most) first = i, most = j - i;
  }
  if (most < kFewest || 2 * most < ratios.size()) return std::nullopt;
  return FloorScale{ratios[first + most / 2], kScaleSigma};
}

double DistanceFactor::cost(const WindowProblem& w) const {
  const double r = ((w.frame(to_).state.T_FB.p - w.frame(from_).state.T_FB.p).norm() - distance_m_) / sigma_m_;
  return huber(r * r, w.weights.huber_sigma).cost;
}

double DistanceFactor::linearise(const WindowProblem& w, NormalEquations& out) const {
  const int i = w.index_of(from_), j = w.index_of(to_);
  const double r = ((w.frames[j].state.T_FB.p - w.frames[i].state.T_FB.p).norm() - distance_m_) / sigma_m_;
  const RobustValue robust = huber(r * r, w.weights.huber_sigma);
  const Vec3 J = (w.linearisation_point(j).T_FB.p - w.linearisation_point(i).T_FB.p).normalized() / sigma_m_;
  const Mat3 H = robust.weight * J * J.transpose();
  const int from = out.layout.pose_row(i), to = out.layout.pose_row(j);
  out.g.segment<3>(from) -= robust.weight * r * J;
  out.g.segment<3>(to) += robust.weight * r * J;
  out.H.block<3, 3>(from, from) += H;
  out.H.block<3, 3>(to, to) += H;
  out.H.block<3, 3>(to, from) -= H;
  return robust.cost;
}

std::shared_ptr<const Factor> distance_by_floor(const NewFrame& f, double drop_m) {
  const Frame *oldest = nullptr, *newest = nullptr;
  for (const Frame& frame : f.window.frames()) {
    if (!frame.keyframe) continue;
    if (oldest == nullptr) oldest = &frame;
    newest = &frame;
  }
  if (oldest == newest) return nullptr;
  if (drop_m < kLeastDrop_m) return nullptr;
  const double distance_m = (newest->state.T_FB.p - oldest->state.T_FB.p).norm();
  if (distance_m < kLeastBaseline_m) return nullptr;
  std::vector<Vec3> landmarks_G;
  for (const LocatedLandmark& l : located_landmarks(f.window, f.calibration))
    if (f.window.landmarks().find(l.track)->frame_count() >= kFewestFrames) landmarks_G.push_back(l.p_G);
  const auto scale = floor_scale(landmarks_G, f.frame.state.T_FB.p, f.window.tilt().gravity_G(-1), drop_m);
  if (!scale) return nullptr;
  return std::make_shared<const DistanceFactor>(oldest->id, newest->id, distance_m / scale->ratio, scale->sigma * distance_m);
}

}  // namespace fbvins
