// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/range_factor.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/estimator/floor_scale.hpp"
#include "fbvins/estimator/window_equations.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

/// A beam nearer to the horizontal than this, as a cosine, says little of the height of a floor and may hit a wall.
constexpr double kLeastCosine = 0.7;
/// What lies so far from a floor, and so many standard deviations, is not on it. Doors' sills and carpets are lower, and are part
/// of the floor's unevenness.
constexpr double kStep_m = 0.06, kStep_sigma = 4;
/// A floor that was out of sight for a while is met again at another height: that of the pose has drifted.
constexpr double kDrift_mps = 0.02, kMostDrift_m = 0.3;
/// A new floor has so many readings in a row, of at least so long a time.
constexpr std::size_t kReadingsOfFloor = 5;
constexpr double kTimeOfFloor_s = 0.25;
/// Known at a time: the floor and what stands on it.
constexpr std::size_t kMostFloors = 4;
/// What handing a reading on to the next frame adds.
constexpr double kHandedOn_m = 0.002;

Vec3 up_G(const Tilt& tilt) { return tilt.gravity_G(-1); }

}  // namespace

double RangeFactor::residual(const WindowProblem& w) const {
  const double height_m = up_G(w.tilt).dot(w.frame(frame_).state.T_FB * hit_B_);
  return (height_m - w.own_variable(floor_).value(0)) / sigma_m_;
}

double RangeFactor::cost(const WindowProblem& w) const {
  const double r = residual(w);
  return huber(r * r, w.weights.huber_sigma).cost;
}

double RangeFactor::linearise(const WindowProblem& w, NormalEquations& out) const {
  const double r = residual(w);
  const RobustValue robust = huber(r * r, w.weights.huber_sigma);
  const int i = w.index_of(frame_);
  const Pose<G, B> T_GB = w.linearisation_point(i).T_FB;
  const Vec3 up = up_G(w.tilt);
  Vec6 J_pose;
  J_pose << up, hit_B_.cross(T_GB.q.conjugate() * up);
  J_pose /= sigma_m_;
  const Vec2 J_tilt = w.tilt.gravity_jacobian(-1).transpose() * (T_GB * hit_B_) / sigma_m_;
  const double J_floor = -1 / sigma_m_;

  const int pose = out.layout.pose_row(i), tilt = out.layout.tilt_row();
  const int floor = row_of(w, out.layout, Variable::own_one(floor_));
  const double weight = robust.weight;
  out.g.segment<6>(pose) += weight * r * J_pose;
  out.g(floor) += weight * r * J_floor;
  out.H.block<6, 6>(pose, pose) += weight * J_pose * J_pose.transpose();
  out.H.block<6, 1>(pose, floor) += weight * J_floor * J_pose;
  out.H(floor, floor) += weight * J_floor * J_floor;
  if (out.layout.tilt_size > 0) {
    out.g.segment<2>(tilt) += weight * r * J_tilt;
    out.H.block<2, 2>(tilt, tilt) += weight * J_tilt * J_tilt.transpose();
    out.H.block<1, 2>(floor, tilt) += weight * J_floor * J_tilt.transpose();
    out.H.block<6, 2>(pose, tilt) += weight * J_pose * J_tilt.transpose();
  }
  return robust.cost;
}

std::shared_ptr<const Factor> RangeFactor::without(const DroppedFrame& d) const {
  return std::make_shared<const RangeFactor>(d.successor, floor_, d.T_successor_dropped * hit_B_,
                                             std::hypot(sigma_m_, kHandedOn_m));
}

/// Each reading is carried to the frame by its velocity and angular rate.
std::optional<RangeMaker::Hit> RangeMaker::hit_of(const NewFrame& f) {
  const NavState<G>& state = f.frame.state;
  Vec3 rate_B = Vec3::Zero();
  if (!f.tracked.imu.empty()) rate_B = f.tracked.imu.samples.back().gyro_radps - state.bias.gyro_radps;
  const Vec3 up_B = state.T_FB.q.conjugate() * up_G(f.window.tilt());
  Hit out;
  double variance = 0;
  int readings = 0;
  for (const RangeSample& r : f.tracked.ranges) {
    if (!(r.distance_m >= r.nearest_m && r.distance_m <= r.farthest_m)) continue;
    const double after_s = (r.t - f.frame.t).seconds();
    const Vec3 along_B = so3_exp(after_s * rate_B) * r.direction_B;
    if (-up_B.dot(along_B) < kLeastCosine) continue;
    out.p_B += after_s * state.v_B() + so3_exp(after_s * rate_B) * r.p_B + r.distance_m * along_B;
    variance += std::pow(r.sigma_m * up_B.dot(along_B), 2);
    ++readings;
  }
  if (readings == 0) return std::nullopt;
  out.p_B /= readings;
  out.sigma_m = std::sqrt(variance) / readings;
  out.height_m = up_G(f.window.tilt()).dot(state.T_FB * out.p_B);
  out.t = f.frame.t;
  return out;
}

double RangeMaker::gate_m(const Hit& hit, const Floor& floor) const {
  const double drift_m = std::min(kMostDrift_m, kDrift_mps * (hit.t - floor.seen).seconds());
  return std::max(kStep_m, kStep_sigma * std::hypot(hit.sigma_m, floor_sigma_m_)) + drift_m;
}

/// The nearest one, if the hit lies on it.
RangeMaker::Floor* RangeMaker::floor_of(const Hit& hit, const SlidingWindow& window) {
  Floor* best = nullptr;
  double nearest_m = 0;
  for (Floor& floor : floors_) {
    const double away_m = std::abs(hit.height_m - window.own(floor.number)->value(0));
    if (away_m > gate_m(hit, floor) || (best != nullptr && away_m > nearest_m)) continue;
    best = &floor, nearest_m = away_m;
  }
  return best;
}

/// A new floor, where the hit is the last of enough that lie on one.
RangeMaker::Floor* RangeMaker::floor_of_candidates(const Hit& hit, SlidingWindow& window) {
  const auto same = [&](const Hit& other) { return std::abs(other.height_m - hit.height_m) < gate_m(hit, {0, other.t}) / 2; };
  if (!std::all_of(candidates_.begin(), candidates_.end(), same)) candidates_.clear();
  candidates_.push_back(hit);
  const bool first = floors_.empty();
  const double since_s = (hit.t - candidates_.front().t).seconds();
  if (!first && (candidates_.size() < kReadingsOfFloor || since_s < kTimeOfFloor_s)) return nullptr;
  candidates_.clear();
  if (floors_.size() == kMostFloors) {
    const auto oldest =
        std::min_element(floors_.begin(), floors_.end(), [](const Floor& a, const Floor& b) { return a.seen < b.seen; });
    window.end_own(oldest->number);
    floors_.erase(oldest);
  }
  floors_.push_back({window.add_own("floor", Eigen::VectorXd::Constant(1, hit.height_m)), hit.t});
  return &floors_.back();
}

bool RangeMaker::is_lowest(const Floor& floor, const SlidingWindow& window) const {
  return std::all_of(floors_.begin(), floors_.end(), [&](const Floor& other) {
    return window.own(floor.number)->value(0) <= window.own(other.number)->value(0) + kStep_m;
  });
}

void RangeMaker::count(const Hit& hit, bool used) {
  const double since_s = newest_ ? std::min(0.5, (hit.t - *newest_).seconds()) : 0;
  newest_ = hit.t;
  left_out_s_ = std::clamp(left_out_s_ + (used ? -since_s : since_s), 0.0, 2 * kDoubt_s);
}

std::vector<std::shared_ptr<const Factor>> RangeMaker::make(const NewFrame& f) {
  std::erase_if(floors_, [&](const Floor& floor) { return f.window.own(floor.number) == nullptr; });  // a new window
  const std::optional<Hit> hit = hit_of(f);
  if (!hit) return {};
  Floor* floor = floor_of(*hit, f.window);
  if (floor != nullptr) candidates_.clear();
  else floor = floor_of_candidates(*hit, f.window);
  count(*hit, floor != nullptr);
  if (floor == nullptr) return {};
  floor->seen = hit->t;
  std::vector<std::shared_ptr<const Factor>> out;
  out.push_back(
      std::make_shared<const RangeFactor>(f.frame.id, floor->number, hit->p_B, std::hypot(hit->sigma_m, floor_sigma_m_)));
  if (images_show_scale_ || f.of_start || !is_lowest(*floor, f.window)) return out;
  FrameId newest;
  for (const Frame& frame : f.window.frames())
    if (frame.keyframe) newest = frame.id;
  if (newest == compared_) return out;
  if (auto distance = distance_by_floor(f, -up_G(f.window.tilt()).dot(f.frame.state.T_FB.q * hit->p_B))) {
    out.push_back(std::move(distance));
    compared_ = newest;
  }
  return out;
}

}  // namespace fbvins
