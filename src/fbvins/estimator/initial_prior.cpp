// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/initial_prior.hpp"

#include <utility>

namespace fbvins {
namespace {

/// The gauge: position and heading of the first frame are chosen; also its roll and pitch, as the tilt of G is estimated.
constexpr double kChosenSigma = 1e-3, kLevelSigma = 1e-4;  // m and rad
/// Weak priors of the other variables.
constexpr double kTiltSigma_rad = 0.5;
constexpr double kVelocitySigma_mps = 5;
constexpr double kGyroBiasSigma_radps = 0.1;
constexpr double kAccelBiasSigma_mps2 = 0.2;

double information(double sigma) { return 1 / (sigma * sigma); }

/// `prior` with new variables before number `at`, at their mean and with information H.
QuadraticPrior inserted(const QuadraticPrior& prior, int at, const Eigen::MatrixXd& H) {
  const int n = static_cast<int>(H.rows()), after = prior.size() - at;
  QuadraticPrior out{Eigen::MatrixXd::Zero(prior.size() + n, prior.size() + n), Eigen::VectorXd::Zero(prior.size() + n)};
  out.H.topLeftCorner(at, at) = prior.H.topLeftCorner(at, at);
  out.H.bottomLeftCorner(after, at) = prior.H.bottomLeftCorner(after, at);
  out.H.topRightCorner(at, after) = prior.H.topRightCorner(at, after);
  out.H.bottomRightCorner(after, after) = prior.H.bottomRightCorner(after, after);
  out.H.block(at, at, n, n) = H;
  out.g.head(at) = prior.g.head(at);
  out.g.tail(after) = prior.g.tail(after);
  return out;
}

}  // namespace

ImuBiasEstimate unknown_biases() {
  return {{},
          kGyroBiasSigma_radps * kGyroBiasSigma_radps * Mat3::Identity(),
          kAccelBiasSigma_mps2 * kAccelBiasSigma_mps2 * Mat3::Identity()};
}

WindowPrior first_frame_prior(const NavState<G>& state, const ImuBiasEstimate& biases) {
  WindowPrior prior;
  prior.frames = {0};
  prior.quadratic.g = Eigen::VectorXd::Zero(15);
  prior.quadratic.H = Eigen::MatrixXd::Zero(15, 15);
  prior.quadratic.H.diagonal() << Vec6::Constant(information(kChosenSigma)), Vec3::Constant(information(kVelocitySigma_mps)),
      Vec6::Zero();
  prior.quadratic.H.block<3, 3>(nav::bg, nav::bg) = biases.gyro_covariance.inverse();
  prior.quadratic.H.block<3, 3>(nav::ba, nav::ba) = biases.accel_covariance.inverse();
  // Heading is about the vertical of the start, which in B is R^T z.
  const Vec3 up_B = state.T_FB.R().transpose() * Vec3::UnitZ();
  const double level = information(kLevelSigma), heading = information(kChosenSigma);
  prior.quadratic.H.block<3, 3>(nav::theta, nav::theta) = level * Mat3::Identity() + (heading - level) * up_B * up_B.transpose();
  Vec15 from_mean = Vec15::Zero();
  from_mean.tail<6>() << state.bias.gyro_radps - biases.bias.gyro_radps, state.bias.accel_mps2 - biases.bias.accel_mps2;
  prior.quadratic = shifted(std::move(prior.quadratic), from_mean);
  prior.with_tilt = true;
  prior.quadratic = inserted(prior.quadratic, 0, information(kTiltSigma_rad) * Mat2::Identity());
  return prior;
}

WindowPrior with_calibration_prior(WindowPrior prior, const CalibrationPrior& sigmas, const Calibration& calibrated) {
  // Derivative of T_C0C1 = T_BC0^-1 T_BC1 by T_BC0 (dp, dtheta), T_BC1 (dp, dtheta):
  // dp = R_0^T (dp_1 - dp_0) + p_01 x dtheta_0, dtheta = dtheta_1 - R_01^T dtheta_0.
  const Mat3 R_0 = calibrated.T_BC0().R(), R_01 = R_0.transpose() * calibrated.T_BC1().R();
  const Vec3 p_01 = R_0.transpose() * (calibrated.T_BC1().p - calibrated.T_BC0().p);
  Eigen::Matrix<double, 6, 12> J = Eigen::Matrix<double, 6, 12>::Zero();
  J.block<3, 3>(0, 0) = -R_0.transpose();
  J.block<3, 3>(0, 3) = hat(p_01);
  J.block<3, 3>(0, 6) = R_0.transpose();
  J.block<3, 3>(3, 3) = -R_01.transpose();
  J.block<3, 3>(3, 9).setIdentity();
  Vec6 between;
  between << Vec3::Constant(information(sigmas.stereo_position_sigma_m)),
      Vec3::Constant(information(sigmas.stereo_rotation_sigma_rad));

  Eigen::Matrix<double, kCalibrationSize, kCalibrationSize> H = decltype(H)::Zero();
  H.topLeftCorner<12, 12>() = J.transpose() * between.asDiagonal() * J;
  H.diagonal().head<3>().array() += information(sigmas.position_sigma_m);
  H.diagonal().segment<3>(3).array() += information(sigmas.rotation_sigma_rad);
  H(kTimeOffsetIndex, kTimeOffsetIndex) = information(sigmas.time_offset_sigma_s);
  H(kLineDelayIndex, kLineDelayIndex) = information(sigmas.line_delay_sigma_s);

  prior.quadratic = inserted(prior.quadratic, prior.calibration_row(), H);
  prior.with_calibration = true;
  prior.calibration = calibrated;
  return prior;
}

}  // namespace fbvins
