// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/consistency_monitor.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/core/median.hpp"
#include "fbvins/estimator/camera_residuals.hpp"
#include "fbvins/estimator/integrity_thresholds.hpp"

namespace fbvins {
namespace {

using namespace thresholds;

Vec3 middle_of(const std::vector<LandmarkObservation>& observations) {
  Vec3 middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const LandmarkObservation& l : observations) along.push_back(l.p_G(axis));
    middle(axis) = median(along);
  }
  return middle;
}

}  // namespace

ConsistencyMonitor::ConsistencyMonitor(const ImuNoise& assumed, bool calibrating)
    : assumed_(assumed), calibrating_(calibrating), usual_shift_(kUsualShift) {}

void ConsistencyMonitor::restart() {
  TiltCheck tilt = std::move(tilt_);
  const double usual_shift = usual_shift_, learned_s = learned_s_;
  *this = ConsistencyMonitor(assumed_, calibrating_);
  usual_shift_ = usual_shift, learned_s_ = learned_s;
  tilt_ = std::move(tilt);
  tilt_.restart();
}

void ConsistencyMonitor::take(const WindowTurns& turns, const Pose<G, B>& now, Duration dt) {
  if (turns.sigma_rad <= 0) return;
  const double off = (turns.off_G.norm() - kTurnScale * turns.turned_rad) / (turns.sigma_rad * (calibrating_ ? kCalibrating : 1));
  if (off < (turning_noise_ > 1 ? kTurnOver_sigma : kTurnSuspected_sigma)) {
    turning_noise_ = 1;
    turns_contradict_ = false;
    return;
  }
  turning_noise_ = std::max(turning_noise_, off);
  if (!may_be_away_) may_be_away_ = true, doubt_.add_position(kTurnedAway_m);
  if (off < kTurn_sigma && !turns_contradict_) return;
  if (!turns_contradict_) turns_contradict_ = turned_away_ = true;
  const Vec3 turn_G = dt.seconds() / turns.span.seconds() * turns.off_G;
  take_doubt(now, now.q.conjugate() * turn_G, turn_G.cross(ahead_G_));
  contradicted_ = true;
  calm_s_ = 0;
}

void ConsistencyMonitor::pass(Duration dt) {
  calm_s_ += dt.seconds();
  blind_s_ = 0;
  since_reset_s_ += dt.seconds();
  contradicted_ = contradicted_ && calm_s_ < kCalm_s;
}

void ConsistencyMonitor::blind(Duration dt) {
  drift_ = none();
  since_reset_s_ += dt.seconds();
  blind_s_ += dt.seconds();
  if (!contradicted_) {
    if (blind_s_ > kDark_s) settling_ = kSettling;
    return;
  }
  tilt_.doubt();  // readings that are doubted have to carry alone
  unrecoverable_ = unrecoverable_ || blind_s_ > kBlind_s;
}

/// `shift`: of the residuals.
void ConsistencyMonitor::add_drift(const OfEachCamera& shift, double focal, const Quat& predicted, double patience, Duration dt) {
  const double kept = std::exp(-dt.seconds() / kDrift_s);
  for (std::size_t c = 0; c < drift_.size(); ++c) {
    drift_[c] = kept * drift_[c] + shift[c];
    drift_[c] *= std::min(1.0, kMost * kDrift_sigma / std::max(1e-9, drift_[c].norm()));
  }
  turned_sigma_ = kept * turned_sigma_ + kScale * focal * predicted.angularDistance(predicted_);
  predicted_ = predicted;
  const double drift = largest_drift() / patience;
  since_sudden_s_ = drift > kDrift_sigma + turned_sigma_ ? 0 : since_sudden_s_ + dt.seconds();
  if (since_sudden_s_ < kForgotten_s) return;
  const double more = drift / (kLasting_sigma + kLastingScale * turned_sigma_) - 1;
  lasting_s_ = std::clamp(lasting_s_ + dt.seconds() * std::min(more, 1.0), 0.0, kLasting_s);
}

double ConsistencyMonitor::largest_drift() const {
  double largest = 0;
  for (const Vec2& drift : drift_) largest = std::max(largest, drift.norm());
  return largest;
}

void ConsistencyMonitor::take(const BiasEstimate& biases) {
  unrecoverable_ = tilt_.take(biases, contradicted_) || unrecoverable_;
}

ConsistencyMonitor::Verdict ConsistencyMonitor::check(const std::vector<LandmarkObservation>& observations,
                                                      const Calibration& calibration, const Pose<G, B>& predicted, Duration dt,
                                                      const Vec3& v_B) {
  Verdict out;
  if (observations.size() < kFewestToJudge) {
    blind(dt);
    return out;
  }
  if (settling_ > 0 && !contradicted_) {
    --settling_;
    pass(dt);
    return out;
  }
  out.noise.gyro = turning_noise_;
  ahead_G_ = middle_of(observations) - predicted.p;
  const ResidualMedians at_prediction = camera_residuals(observations, calibration, predicted, v_B);
  const double room = std::clamp(usual_shift_ / kUsualShift, 1.0, kMostRoom);
  const double patience = room * (calibrating_ ? kCalibrating : 1) * std::max(1.0, dt.seconds() / kUsualFor_s) *
                          hypotenuse(1.0, kSpread_sigma * spread(predicted.q, v_B, at_prediction.focal, dt));
  const double excess = at_prediction.worst() / (patience * kUsual_sigma) - 1;
  learn(at_prediction.shift, patience / room, dt);
  add_drift(at_prediction.shift, at_prediction.focal, predicted.q, patience, dt);
  const bool drifting = largest_drift() > patience * (kDrift_sigma + turned_sigma_) || lasting_s_ >= kLasting_s;
  if (excess < 0 && !drifting) {
    take_agreement(excess, dt);
    return out;
  }
  const PoseRefinement seen = refine_pose(observations, calibration, predicted, v_B);
  const ResidualMedians at_seen = camera_residuals(observations, calibration, seen.T_GB, v_B);
  std::vector<double> off;
  for (std::size_t c = 0; c < static_cast<std::size_t>(calibration.camera_count()); ++c)
    off.push_back(excess < 0 ? drift_[c].norm() : at_prediction.norm[c].value_or(0));
  const std::uint8_t wrong = camera_off_alone(
      observations, at_prediction, off, [&](double worst) { return excess < 0 ? kOther * worst : patience * kUsual_sigma; });
  if (excess < 0 && std::popcount(wrong) > 1) {
    pass(dt);  // something moves before one of several pairs
    return out;
  }
  const bool explained = seen.inliers >= kAgreeing * static_cast<double>(observations.size()) &&
                         (excess < 0 || at_seen.worst() < kBetter * at_prediction.worst());
  if (!explained && wrong == 0) {
    take_unexplained(dt);
    return out;
  }
  evidence_ = std::min(kMost, std::max(evidence_ + excess, drifting ? kContradiction : 0.0));
  if (evidence_ < kContradiction) {
    pass(dt);
    return out;
  }
  if (wrong != 0) {
    if (exclude(excess < 0, dt)) out.wrong = wrong;
    pass(dt);  // the readings agree with the others
    return out;
  }
  follow(seen.T_GB, predicted, dt, out);
  return out;
}

void ConsistencyMonitor::take_agreement(double excess, Duration dt) {
  evidence_ = std::max(0.0, evidence_ + excess);
  unexplained_s_ = std::max(0.0, unexplained_s_ - dt.seconds());
  unexplained_ = unexplained_ && unexplained_s_ > 0;
  pass(dt);
}

void ConsistencyMonitor::take_unexplained(Duration dt) {
  unexplained_s_ = std::min(kCalm_s, unexplained_s_ + dt.seconds());
  unexplained_ = unexplained_ || unexplained_s_ > kDark_s;
  blind(dt);
}

void ConsistencyMonitor::learn(const OfEachCamera& shift, double patience, Duration dt) {
  if (contradicted_) return;
  double largest = 0;
  for (const Vec2& of_camera : shift) largest = std::max(largest, of_camera.norm() / patience);
  learned_s_ = std::min(kLearnedOver_s, learned_s_ + dt.seconds());
  const double share = std::min(1.0, dt.seconds() / (kLearnedAtFirst_s + learned_s_));
  usual_shift_ += share * (std::min(largest, kLargestLearned) - usual_shift_);
}

/// What the noise of the readings and of two stamps and an uncertain velocity move all features by, in standard deviations of
/// one.
double ConsistencyMonitor::spread(const Quat& predicted, const Vec3& v_B, double focal, Duration dt) const {
  const double s = std::max(1e-3, dt.seconds());
  const double ahead_m = std::max(kNearest_m, ahead_G_.norm());
  const double by_stamps =
      std::sqrt(2.0) * expected_.stamp_s * (predicted.angularDistance(predicted_) / s + v_B.norm() / ahead_m);
  const double by_noise = expected_.noise.gyro * assumed_.gyro_noise_density_radps_rthz * std::sqrt(s);
  return focal * std::hypot(by_stamps, by_noise, s * expected_.velocity_mps / ahead_m);
}

/// Whether a camera that is off is left out of this image.
bool ConsistencyMonitor::exclude(bool for_drift_alone, Duration dt) {
  excluded_s_ = for_drift_alone ? excluded_s_ + dt.seconds() : 0;
  if (excluded_s_ <= kReadmitted_s) return true;
  excluded_s_ = evidence_ = lasting_s_ = 0;
  drift_ = none();
  return false;
}

/// The images are believed, and the readings count as much as they agree.
void ConsistencyMonitor::follow(const Pose<G, B>& seen, const Pose<G, B>& predicted, Duration dt, Verdict& out) {
  const Vec3 turn = so3_log((predicted.q.conjugate() * seen.q).normalized());
  const Vec3 shift = seen.p - predicted.p;
  out.imu_contradicts = true;
  out.seen = seen;
  out.noise.gyro = std::max(out.noise.gyro, turn.norm() / (assumed_.gyro_noise_density_radps_rthz * std::sqrt(dt.seconds())));
  out.noise.accel =
      std::max(1.0, shift.norm() / (assumed_.accel_noise_density_mps2_rthz * std::sqrt(std::pow(dt.seconds(), 3) / 3)));
  take_doubt(predicted, turn, shift);
  contradicted_ = true;
  calm_s_ = blind_s_ = 0;
}

void ConsistencyMonitor::take_doubt(const Pose<G, B>& predicted, const Vec3& turn_B, const Vec3& shift_G) {
  doubt_.add(predicted, turn_B, shift_G);
  tilt_.add_turn(predicted.q * turn_B);
}

bool ConsistencyMonitor::take_reset() {
  if (contradicted() || !(doubt_.large() || turned_away_)) return false;
  turned_away_ = may_be_away_ = false;
  doubt_.clear();
  count_reset();
  return true;
}

void ConsistencyMonitor::count_reset() {
  unrecoverable_ = unrecoverable_ || since_reset_s_ < kNextReset_s;
  since_reset_s_ = 0;
}

}  // namespace fbvins
