// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/tilt_check.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "fbvins/estimator/integrity_thresholds.hpp"

namespace fbvins {
namespace {

using namespace thresholds;

/// A change of a bias in standard deviations, of which `floor` is the least. Of a consistent estimate the covariance of a change
/// is what it gained or lost meanwhile, and `uncertain` more: errors of linearisation.
double change_sigma(const Vec3& change, const Mat3& before, const Mat3& after, double floor, double uncertain) {
  const Eigen::SelfAdjointEigenSolver<Mat3> gained(before - after);
  const Vec3 along = gained.eigenvectors().transpose() * change;
  return std::sqrt((along.array().square() / (gained.eigenvalues().array().abs() + uncertain + floor * floor)).sum());
}

double accel_sigma(const BiasEstimate& from, const BiasEstimate& to, double least_mps2) {
  return change_sigma(to.bias.accel_mps2 - from.bias.accel_mps2, from.accel, to.accel, least_mps2 / kMoved_sigma,
                      to.accel.trace() / 3);
}

bool moved(const BiasEstimate& from, const BiasEstimate& to, double accel_mps2, double gyro_radps) {
  return accel_sigma(from, to, accel_mps2) > kMoved_sigma ||
         change_sigma(to.bias.gyro_radps - from.bias.gyro_radps, from.gyro, to.gyro, gyro_radps / kMoved_sigma, 0) > kMoved_sigma;
}

}  // namespace

void TiltCheck::restart() {
  const std::optional<BiasEstimate> refuted = refuted_;
  *this = {};
  refuted_ = refuted;
}

void TiltCheck::doubt() {
  if (biases_.empty()) in_doubt_ = true;
  else doubt(biases_.front());
}

void TiltCheck::doubt(const BiasEstimate& before) {
  if (in_doubt_) return;
  in_doubt_ = true;
  before_ = before;
  confirmed_s_ = refuted_s_ = 0;
}

void TiltCheck::add_turn(const Vec3& turn_G) {
  tilt_G_ += Vec3(turn_G.x(), turn_G.y(), 0);
  if (tilt_G_.norm() > kDoubtedTilt_rad) doubt();
}

bool TiltCheck::take(const BiasEstimate& now, bool contradicted) {
  if (!begun_) begun_ = now.t;
  if ((now.t - *begun_).seconds() < kBegun_s && !refuted_) return false;
  const double dt_s = biases_.empty() ? 0 : (now.t - biases_.back().t).seconds();
  biases_.push_back(now);
  while ((now.t - biases_.front().t).seconds() > kJump_s) biases_.pop_front();
  if (refuted_ && (now.t - refuted_->t).seconds() > kRefutedRemembered_s) refuted_.reset(), before_.reset();
  const BiasEstimate& from = refuted_ ? *refuted_ : biases_.front();
  suspected_ = accel_sigma(from, now, kAccelJump_mps2) > kSuspectedMove_sigma;
  if (moved(from, now, kAccelJump_mps2, kGyroJump_radps)) doubt(from);
  if (!in_doubt_ || contradicted) return false;
  const bool away = before_ && moved(*before_, now, kAccelBack_mps2, kGyroBack_radps);
  (away ? refuted_s_ : confirmed_s_) += dt_s;
  (away ? confirmed_s_ : refuted_s_) = 0;
  if (refuted_s_ > kConfirmed_s && !refuted_) {  // a second start would be doubted like the first one
    if ((before_->t - *begun_).seconds() > kSettled_s) refuted_ = before_;
    return true;
  }
  if (confirmed_s_ <= kConfirmed_s) return false;
  in_doubt_ = false;
  tilt_G_.setZero();
  before_.reset(), refuted_.reset();
  biases_ = {now};
  return false;
}

}  // namespace fbvins
