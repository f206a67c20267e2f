// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/propagated_gravity.hpp"

#include <algorithm>
#include <iterator>

#include "fbvins/estimator/integrity_thresholds.hpp"
#include "fbvins/imu/propagation.hpp"

namespace fbvins {
namespace {

using namespace thresholds;

Vec3 turn_between(const Vec3& from, const Vec3& to) { return so3_log(so3_between(from, to)); }

Vec3 carried(const Vec3& up_B, const ImuSegment& readings, const Vec3& gyro_bias_radps) {
  return integrate_gyro(readings, gyro_bias_radps).conjugate() * up_B;
}

}  // namespace

void PropagatedGravity::carry(Time t, const ImuSegment& readings) {
  now_ = t;
  if (readings.empty() || readings.longest_gap.seconds() > kReadingsGap_s) return forget();
  if (before_) before_->up_B = carried(before_->up_B, readings, before_->gyro_bias_radps);
  if (before_ && (t - since_).seconds() > kUpRemembered_s) before_.reset();
  if (!recent_.empty() && (t - recent_.front().t).seconds() > kUpRemembered_s) recent_.clear();
  recent_.push_back({t, readings, {}});
}

void PropagatedGravity::take(const Known& known) {
  if (recent_.empty()) return;
  recent_.back().known = known;
  auto first = std::find_if(recent_.begin(), recent_.end(), [](const Entry& e) { return e.known.has_value(); });
  for (auto e = first; e != recent_.end() && (now_ - e->t).seconds() >= kBefore_s; ++e)
    if (e->known) first = e;
  recent_.erase(recent_.begin(), first);
  const bool agree = before_ && turn_between(known.up_B, before_->up_B).norm() <= kUpAway_rad;
  if (agree && (now_ - recent_.front().t).seconds() >= kBefore_s) before_.reset();  // confirmed
}

void PropagatedGravity::keep() {
  if (!recent_.empty() && recent_.front().known) {
    before_ = recent_.front().known, since_ = recent_.front().t;
    for (auto e = std::next(recent_.begin()); e != recent_.end(); ++e)
      before_->up_B = carried(before_->up_B, e->readings, before_->gyro_bias_radps);
  }
  recent_.clear();
}

void PropagatedGravity::hold() {
  if (before_) return;
  keep();
  restarted_ = false;
}

void PropagatedGravity::restart() {
  keep();
  restarted_ = true;
}

std::optional<PropagatedGravity::Difference> PropagatedGravity::difference(const Vec3& up_B, const Vec3& gyro_bias_radps) const {
  if (!before_) return std::nullopt;
  const double dt_s = (now_ - since_).seconds();
  const double sigma_rad =
      Vec3(before_->sigma_rad, before_->gyro_sigma_radps * dt_s, (gyro_bias_radps - before_->gyro_bias_radps).norm() * dt_s)
          .norm();
  const Vec3 turn_B = turn_between(up_B, before_->up_B);
  return Difference{turn_B, restarted_ && turn_B.norm() > kUpAway_rad + kUpAway_sigma * sigma_rad};
}

}  // namespace fbvins
