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

RestRefusal judge(const Spread& s, const ImuNoise& noise, const RestOptions& o, double g) {
  const double root_block = std::sqrt(o.block_s);
  const double gyro_limit = std::max(o.max_gyro_spread_radps, o.noise_factor * noise.gyro_noise_density_radps_rthz / root_block);
  const double accel_limit = std::max(o.max_accel_spread_mps2, o.noise_factor * noise.accel_noise_density_mps2_rthz / root_block);
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
    case RestRefusal::gyro_spread: return "gyro_spread";
    case RestRefusal::accel_spread: return "accel_spread";
    case RestRefusal::gyro_mean: return "gyro_mean";
    case RestRefusal::accel_mean: return "accel_mean";
  }
  return "?";
}

Quat level_rotation(const Vec3& up_B) { return so3_between(up_B, Vec3::UnitZ()).normalized(); }

RestEstimate initialise_at_rest(const std::vector<ImuSample>& window, const ImuNoise& noise, const RestOptions& options,
                                double gravity_mps2) {
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
  r.reason = judge(s, noise, options, gravity_mps2);
  r.at_rest = r.reason == RestRefusal::none;
  if (!r.at_rest) return r;
  r.state.T_FB.q = level_rotation(s.accel_mean);  // eq. A2
  r.state.bias.gyro_radps = s.gyro_mean;
  r.force_mps2 = s.accel_mean;
  return r;
}

}  // namespace fbvins
