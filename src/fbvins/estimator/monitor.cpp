// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fbvins/core/angle.hpp"

namespace fbvins {
namespace {

/// Landmarks in an image without which it proves nothing, for a camera and for a pose.
constexpr std::size_t kFewest = 15;
/// Median residuals at the predicted pose, in standard deviations of a feature: up to 1 where all is well. More is expected
/// after a longer time.
constexpr double kUsual_sigma = 1.5, kUsualFor_s = 0.06;
/// Times as much while the calibration is being found.
constexpr double kCalibrating = 6;
/// Where the images' own pose does not explain them much better, the prediction is not what is wrong.
constexpr double kBetter = 0.6;
/// Share of the landmarks that agree with one pose where images can be right against the readings.
constexpr double kAgreeing = 0.6;
/// CUSUM of (median / usual - 1): a contradiction from here on; no more is kept.
constexpr double kContradiction = 1, kMost = 2;
constexpr double kCalm_s = 0.5, kBlind_s = 0.3;
/// A doubt that is told as a reset; two of them within a few seconds are no way to fly.
constexpr double kReset_m = 0.1, kReset_rad = 3 * kDegree, kNextReset_s = 5;
/// A doubt about the tilt that gravity has to confirm, within this time, by an accelerometer's bias that stays.
constexpr double kTilt_rad = 1 * kDegree, kConfirmed_s = 1.5, kBiasMoved_mps2 = 0.1, kBiasMoved_sigma = 4;

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Medians {
  std::optional<double> of[2];  ///< left, right; none with few landmarks
  double worst() const { return std::max(of[0].value_or(0), of[1].value_or(0)); }
};

Medians medians(const std::vector<PointSighting>& sightings, const CameraGeometry& cameras, const Pose<W, B>& T_WB) {
  const Mat3 R_BW = T_WB.R().transpose();
  Medians out;
  for (int c = 0; c < 2; ++c) {
    std::vector<double> residuals;
    for (const PointSighting& s : sightings) {
      const std::optional<Observation>& o = c == 0 ? s.feature->left : s.feature->right;
      if (!o) continue;
      const Vec3 p_C = cameras.R_CB[c] * (R_BW * (s.p_W - T_WB.p) - cameras.t_BC[c]);
      residuals.push_back(p_C.z() > kMinScaledDepth ? (o->sqrt_information * (p_C.head<2>() / p_C.z() - o->normalised)).norm()
                                                    : 1e3);
    }
    if (residuals.size() >= kFewest) out.of[c] = median_of(residuals);
  }
  return out;
}

}  // namespace

void Monitor::restart() { *this = Monitor(assumed_, calibrating_); }

void Monitor::pass(Duration dt) {
  calm_s_ += dt.seconds();
  blind_s_ = 0;
  since_reset_s_ += dt.seconds();
  contradicted_ = contradicted_ && calm_s_ < kCalm_s;
}

void Monitor::blind(Duration dt) {
  since_reset_s_ += dt.seconds();
  blind_s_ += dt.seconds();
  if (!contradicted_) return;
  tilt_doubted_ = true;  // readings that are doubted have to carry alone
  hopeless_ = hopeless_ || blind_s_ > kBlind_s;
}

void Monitor::take_bias(const Vec3& accel_bias_mps2, const Mat3& covariance) {
  accel_bias_ = accel_bias_mps2;
  bias_sigma_ = std::sqrt(covariance.trace());
  if (!tilt_doubted_ || contradicted_) return;
  const double moved_mps2 = std::max(kBiasMoved_mps2, kBiasMoved_sigma * bias_sigma_before_);
  if ((accel_bias_ - accel_bias_before_).norm() > moved_mps2) hopeless_ = true;
  else if (calm_s_ > kConfirmed_s) tilt_doubted_ = false, tilt_W_.setZero();
}

Monitor::Verdict Monitor::examine(const std::vector<PointSighting>& sightings, const Calibration& calibration,
                                  const Pose<W, B>& predicted, Duration dt) {
  Verdict out;
  if (sightings.size() < kFewest) {
    blind(dt);
    return out;
  }
  const double usual = (calibrating_ ? kCalibrating : 1) * kUsual_sigma * std::max(1.0, dt.seconds() / kUsualFor_s);
  const CameraGeometry cameras(calibration);
  const Medians at_prediction = medians(sightings, cameras, predicted);
  const double excess = at_prediction.worst() / usual - 1;
  if (excess < 0) {
    evidence_ = std::max(0.0, evidence_ + excess);
    pass(dt);
    return out;
  }
  const PoseRefinement seen = refine_pose(sightings, calibration, predicted);
  const Medians at_seen = medians(sightings, cameras, seen.T_WB);
  const bool one_camera_fits =
      at_prediction.of[0] && at_prediction.of[1] && std::min(*at_prediction.of[0], *at_prediction.of[1]) < usual;
  const bool explained =
      at_seen.worst() < kBetter * at_prediction.worst() && seen.inliers >= kAgreeing * static_cast<double>(sightings.size());
  if (!explained && !one_camera_fits) {
    blind(dt);
    return out;
  }
  evidence_ = std::min(kMost, evidence_ + excess);
  if (evidence_ < kContradiction) {
    pass(dt);
    return out;
  }
  if (one_camera_fits) {
    out.left_wrong = *at_prediction.of[0] > *at_prediction.of[1];
    out.right_wrong = !out.left_wrong;
  } else {
    const Vec3 turn = so3_log((predicted.q.conjugate() * seen.T_WB.q).normalized());
    const Vec3 shift = seen.T_WB.p - predicted.p;
    out.imu_contradicts = true;
    out.seen = seen.T_WB;
    out.noise.gyro = std::max(1.0, turn.norm() / (assumed_.gyro_noise_density_radps_rthz * std::sqrt(dt.seconds())));
    out.noise.accel =
        std::max(1.0, shift.norm() / (assumed_.accel_noise_density_mps2_rthz * std::sqrt(std::pow(dt.seconds(), 3) / 3)));
    take_doubt(predicted, turn, shift);
  }
  contradicted_ = true;
  calm_s_ = blind_s_ = 0;
  return out;
}

void Monitor::take_doubt(const Pose<W, B>& predicted, const Vec3& turn_B, const Vec3& shift_W) {
  if (!contradicted()) accel_bias_before_ = accel_bias_, bias_sigma_before_ = bias_sigma_;
  if (turn_W_.isZero(0)) where_W_ = predicted.p;
  const Vec3 turn_W = predicted.q * turn_B;
  turn_W_ += turn_W, shift_W_ += shift_W;
  turns_W_ += turn_W * turn_W.transpose(), shifts_W_ += shift_W * shift_W.transpose();
  tilt_W_ += Vec3(turn_W.x(), turn_W.y(), 0);
  tilt_doubted_ = tilt_doubted_ || tilt_W_.norm() > kTilt_rad;
}

bool Monitor::take_reset() {
  if (contradicted() || (shift_W_.norm() < kReset_m && turn_W_.norm() < kReset_rad)) return false;
  turn_W_.setZero(), shift_W_.setZero(), turns_W_.setZero(), shifts_W_.setZero();
  hopeless_ = since_reset_s_ < kNextReset_s;
  since_reset_s_ = 0;
  return true;
}

Mat6 Monitor::doubt(const Pose<W, B>& T_WB) const {
  const Mat3 R_BW = T_WB.R().transpose();
  const Mat3 turns_W = turns_W_ + turn_W_ * turn_W_.transpose();
  const Mat3 lever = hat(T_WB.p - where_W_);
  Mat6 out = Mat6::Zero();
  out.topLeftCorner<3, 3>() = shifts_W_ + shift_W_ * shift_W_.transpose() + lever * turns_W * lever.transpose();
  out.bottomRightCorner<3, 3>() = R_BW * turns_W * R_BW.transpose();
  return out;
}

}  // namespace fbvins
