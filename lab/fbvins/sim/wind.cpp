// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/wind.hpp"

#include <algorithm>
#include <numbers>

namespace fbvins {
namespace {

/// Height from which the wind has its full strength; at the floor there is none.
constexpr double kFullWind_m = 0.5;

}  // namespace

Wind::Wind(const WindOptions& options, std::uint64_t seed) : options_(options), rng_(seed, 71) {
  const double heading = rng_.uniform(-std::numbers::pi, std::numbers::pi);
  along_W_ = Vec3(std::cos(heading), std::sin(heading), 0);
  across_W_ = Vec3::UnitZ().cross(along_W_);
}

// MIL-F-8785C: (1 + sqrt(3) T s) / (1 + T s)^2 across and upwards is sqrt(3) of the first filter and 1 - sqrt(3) of the
// second; its variance is twice that of the first alone.
Vec3 Wind::step(double dt_s, double height_m) {
  const double kept = std::exp(-dt_s / options_.gust_s);
  std::array<double, 3> gust{};
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    Filter& f = filters_[i];
    f.twice += (1 - kept) * (f.once - f.twice);
    f.once = kept * f.once + std::sqrt(1 - kept * kept) * rng_.normal();
    gust[i] = i == 0 ? f.once : (std::numbers::sqrt3 * f.once + (1 - std::numbers::sqrt3) * f.twice) / std::numbers::sqrt2;
  }
  const Vec3 wind_W = (options_.mean_mps + options_.gust_mps * gust[0]) * along_W_ + options_.gust_mps * gust[1] * across_W_ +
                      Vec3(0, 0, 0.5 * options_.gust_mps * gust[2]);
  return std::clamp(height_m / kFullWind_m, 0.0, 1.0) * wind_W;
}

}  // namespace fbvins
