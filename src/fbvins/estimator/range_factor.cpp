// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/range_factor.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/estimator/floor_scale.hpp"

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
Vec3 up_G(const Tilt& tilt) { return tilt.gravity_G(-1); }

}  // namespace

/// Each reading is carried to the frame by its velocity and angular rate.
std::optional<RangeMaker::Hit> RangeMaker::hit_of(const NewFrame& f) {
  const NavState<G>& state = f.frame.state;
  Vec3 rate_B = Vec3::Zero();
  if (!f.tracked.imu.empty()) rate_B = f.tracked.imu.samples.back().gyro_radps - state.bias.gyro_radps;
  const Vec3 up_B = state.T_FB.q.conjugate() * up_G(f.window.tilt());
  Hit out;
  double variance = 0;
  int readings = 0;
  for (const RangeSample& r : readings_of<RangeSample>(f.tracked.aiding)) {
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
  return std::max(kStep_m, kStep_sigma * hypotenuse(hit.sigma_m, floor_sigma_m_)) + drift_m;
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

std::vector<std::shared_ptr<const Factor>> RangeMaker::make(const NewFrame& f) {
  std::erase_if(floors_, [&](const Floor& floor) { return f.window.own(floor.number) == nullptr; });  // a new window
  const std::optional<Hit> hit = hit_of(f);
  if (!hit) return {};
  Floor* floor = floor_of(*hit, f.window);
  if (floor != nullptr) candidates_.clear();
  else floor = floor_of_candidates(*hit, f.window);
  doubt_.count(hit->t, floor != nullptr);
  if (floor == nullptr) return {};
  floor->seen = hit->t;
  std::vector<std::shared_ptr<const Factor>> out;
  out.push_back(
      std::make_shared<const HeightFactor>(f.frame.id, floor->number, hit->p_B, hypotenuse(hit->sigma_m, floor_sigma_m_)));
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
