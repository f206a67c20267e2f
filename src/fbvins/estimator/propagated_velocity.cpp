// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/propagated_velocity.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/estimator/integrity_thresholds.hpp"
#include "fbvins/imu/propagation.hpp"

namespace fbvins {
namespace {

using namespace thresholds;

}  // namespace

void PropagatedVelocity::Carried::carry(const ImuSegment& readings) {
  known.state = propagate(known.state, readings, known.gravity_G);
  seconds += (readings.samples.back().t - readings.samples.front().t).seconds();
}

bool PropagatedVelocity::Carried::joins(const std::vector<TrackId>& seen) const {
  std::vector<TrackId> both;
  std::set_intersection(seen.begin(), seen.end(), tracks.begin(), tracks.end(), std::back_inserter(both));
  return both.size() >= kFewestLinked && static_cast<double>(both.size()) >= kLinked * static_cast<double>(seen.size());
}

double PropagatedVelocity::Carried::sigma_mps() const {
  const double t = seconds, g = known.gravity_G.norm();
  return std::hypot(hypotenuse(known.velocity_sigma_mps, g * known.tilt_sigma_rad * t),
                    hypotenuse(g * known.gyro_bias_sigma_radps * t * t / 2, known.accel_bias_sigma_mps2 * t), kAccel_mps2 * t);
}

/// What the pose has moved by is still told.
void PropagatedVelocity::forget() {
  const Vec3 shift_G = shift_G_;
  *this = {};
  shift_G_ = shift_G;
}

void PropagatedVelocity::carry(const ImuSegment& readings) {
  if (!newest_) return;
  if (readings.empty() || readings.longest_gap.seconds() > kReadingsGap_s) return forget();
  newest_->carry(readings);
  if (before_) {
    const double before_s = before_->seconds;
    before_->carry(readings);
    shift_G_ += (before_->seconds - before_s) * velocity_G_;
  }
  if ((before_ ? before_ : newest_)->seconds > kCarriedFor_s) forget();
}

void PropagatedVelocity::compare(const Known& now, std::vector<TrackId> seen, bool contradicted) {
  std::sort(seen.begin(), seen.end());
  if (!newest_) {
    if (!contradicted) newest_ = Carried{now, 0, std::move(seen)};
    return;
  }
  // A velocity that is known less well than the one carried on says nothing of it, and does not replace it.
  const bool known = now.velocity_sigma_mps <= std::max(kKnown_mps, newest_->sigma_mps());
  const bool joined = newest_->joins(seen);
  if (!joined) {
    if (!known || seen.size() < kFewestToJudge) return;
    judge(now.state);
  }
  // Nor does one of images that contradict the readings. Which of the two is wrong is unknown, so nothing is carried on for long.
  const bool disputed = joined && contradicted && !before_;
  if (disputed && newest_->seconds > kDisputed_s) {
    newest_.reset();
    return;
  }
  if (known && !disputed) newest_ = Carried{now, 0, std::move(seen)};
  else newest_->tracks = std::move(seen);
  if (before_ && over()) before_.reset(), velocity_G_.setZero();
}

void PropagatedVelocity::judge(const NavState<G>& now) {
  const Vec3 jump_B = now.v_B() - newest_->known.state.v_B();
  if (jump_B.norm() <= std::max(kVelocity_mps, kVelocity_sigma * newest_->sigma_mps())) return;
  if (!before_) before_ = newest_, begun_mps_ = jump_B.norm();
  const Vec3 jump_G = now.T_FB.q * jump_B;
  velocity_G_ += jump_G;
  shift_G_ += newest_->seconds * jump_G;
}

bool PropagatedVelocity::over() const {
  const double small_mps = std::max(kVelocity_mps, begun_mps_ / 2);
  const double away_mps = (newest_->known.state.v_B() - before_->known.state.v_B()).norm();
  return velocity_G_.norm() <= small_mps || away_mps <= small_mps || before_->joins(newest_->tracks);
}

bool PropagatedVelocity::take_reset() {
  if (contradicted()) return false;
  const bool moved = shift_G_.norm() >= kMovedAlong_m;
  shift_G_.setZero();
  return moved;
}

}  // namespace fbvins
