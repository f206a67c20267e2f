// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/static_initialiser.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

struct Spread {
  Vec3 gyro_mean = Vec3::Zero(), accel_mean = Vec3::Zero();
  double gyro = 0, accel = 0;  ///< standard deviation of the block means, worst axis
};

/// Mean of the readings and spread of their means over blocks (eq. A1).
Spread measure(const std::vector<ImuSample>& window, double block_s) {
  std::vector<Vec6> blocks;
  std::size_t k = 0;
  while (k < window.size()) {
    const Time begin = window[k].t;
    Vec6 sum = Vec6::Zero();
    int n = 0;
    for (; k < window.size() && (window[k].t - begin).seconds() < block_s; ++k, ++n) {
      sum.head<3>() += window[k].gyro_radps;
      sum.tail<3>() += window[k].accel_mps2;
    }
    const bool too_short = (window.back().t - begin).seconds() < 0.5 * block_s;  // the rest of the window
    if (!too_short || blocks.empty()) blocks.push_back(sum / n);
  }
  Vec6 mean = Vec6::Zero(), variance = Vec6::Zero();
  for (const Vec6& b : blocks) mean += b / static_cast<double>(blocks.size());
  for (const Vec6& b : blocks) variance += (b - mean).cwiseAbs2() / static_cast<double>(blocks.size());
  const Vec6 sigma = variance.cwiseSqrt();
  return {mean.head<3>(), mean.tail<3>(), sigma.head<3>().maxCoeff(), sigma.tail<3>().maxCoeff()};
}

double longest_step_s(const std::vector<ImuSample>& window) {
  Duration longest{};
  for (std::size_t k = 1; k < window.size(); ++k) longest = std::max(longest, window[k].t - window[k - 1].t);
  return longest.seconds();
}

/// Covariance of the state at rest (eq. A3-A5).
Mat15 covariance_at_rest(const Vec3& up_B, double window_s, const ImuNoise& noise, const RestOptions& o, double g) {
  const auto squared = [](double x) { return x * x; };
  const double accel_noise = squared(noise.accel_noise_density_mps2_rthz) / window_s;
  const double gyro_noise = squared(noise.gyro_noise_density_radps_rthz) / window_s;
  const double bias = squared(o.accel_bias_sigma_mps2);
  const Mat3 tilt_accel = hat(up_B) / g;  // tilt error by error of the specific force, eq. A3
  const Mat3 yaw = squared(o.yaw_sigma_rad) * up_B * up_B.transpose();
  const double tilt_floor = squared(1e-4);  // vibration and the like; keeps the matrix invertible
  Mat15 P = Mat15::Zero();
  P.diagonal().segment<3>(nav::p).setConstant(squared(o.position_sigma_m));
  P.block<3, 3>(nav::theta, nav::theta) = (bias + accel_noise) * tilt_accel * tilt_accel.transpose() + yaw;
  P.diagonal().segment<3>(nav::theta).array() += tilt_floor;
  P.block<3, 3>(nav::theta, nav::ba) = bias * tilt_accel;
  P.block<3, 3>(nav::ba, nav::theta) = bias * tilt_accel.transpose();
  P.diagonal().segment<3>(nav::v).setConstant(squared(o.velocity_sigma_mps));
  P.diagonal().segment<3>(nav::bg).setConstant(gyro_noise + squared(1e-4));
  P.diagonal().segment<3>(nav::ba).setConstant(bias);
  const Mat15 symmetric = 0.5 * (P + P.transpose());  // exactly, in spite of rounding
  return symmetric;
}

RestRefusal judge(const Spread& s, double image_motion_px, const ImuNoise& noise, const RestOptions& o, double g) {
  const double root_block = std::sqrt(o.block_s);
  const double gyro_limit = std::max(o.max_gyro_spread_radps, o.noise_factor * noise.gyro_noise_density_radps_rthz / root_block);
  const double accel_limit = std::max(o.max_accel_spread_mps2, o.noise_factor * noise.accel_noise_density_mps2_rthz / root_block);
  if (!(image_motion_px <= o.max_image_motion_px)) return RestRefusal::image_moves;
  if (!(s.gyro <= gyro_limit)) return RestRefusal::gyro_spread;
  if (!(s.accel <= accel_limit)) return RestRefusal::accel_spread;
  if (!(s.gyro_mean.norm() <= o.max_gyro_mean_radps)) return RestRefusal::gyro_mean;
  if (!(std::abs(s.accel_mean.norm() - g) <= o.max_accel_error_mps2)) return RestRefusal::accel_mean;
  return RestRefusal::none;
}

}  // namespace

std::string_view to_string(RestRefusal reason) {
  switch (reason) {
    case RestRefusal::none: return "none";
    case RestRefusal::too_short: return "too_short";
    case RestRefusal::imu_gap: return "imu_gap";
    case RestRefusal::image_moves: return "image_moves";
    case RestRefusal::gyro_spread: return "gyro_spread";
    case RestRefusal::accel_spread: return "accel_spread";
    case RestRefusal::gyro_mean: return "gyro_mean";
    case RestRefusal::accel_mean: return "accel_mean";
  }
  return "?";
}

Quat level_rotation(const Vec3& up_B) { return so3_between(up_B, Vec3::UnitZ()).normalized(); }

RestEstimate initialise_at_rest(const std::vector<ImuSample>& window, double image_motion_px, const ImuNoise& noise,
                                const RestOptions& options, double gravity_mps2) {
  RestEstimate r;
  const double window_s = window.empty() ? 0.0 : (window.back().t - window.front().t).seconds();
  if (window.size() < 3 || window_s < options.min_window_s) {
    r.reason = RestRefusal::too_short;
    return r;
  }
  if (longest_step_s(window) > options.max_gap_s) {
    r.reason = RestRefusal::imu_gap;
    return r;
  }
  const Spread s = measure(window, options.block_s);
  r.gyro_spread_radps = s.gyro;
  r.accel_spread_mps2 = s.accel;
  r.reason = judge(s, image_motion_px, noise, options, gravity_mps2);
  r.at_rest = r.reason == RestRefusal::none;
  if (!r.at_rest) return r;
  r.state.T_FB.q = level_rotation(s.accel_mean);  // eq. A2
  r.state.bias.gyro_radps = s.gyro_mean;
  r.covariance = covariance_at_rest(s.accel_mean.normalized(), window_s, noise, options, gravity_mps2);
  return r;
}

}  // namespace fbvins
