// SPDX-License-Identifier: Apache-2.0
// Wind: a steady part and Dryden turbulence. The same seed gives the same bits. One owner.
//
//   Wind wind(options, seed);
//   Vec3 wind_W = wind.step(1e-3, height_m);   // m/s, in W
#pragma once

#include <array>
#include <cstdint>

#include "fbvins/core/rng.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

struct WindOptions {
  double mean_mps = 0.3;
  double gust_mps = 0.2;
  double gust_s = 1.5;

  template <class V>
  void visit(V&& v) {
    v("mean_mps", mean_mps, "m/s", "speed of the steady part; its direction comes from the seed", 0.0, 20.0);
    v("gust_mps", gust_mps, "m/s", "standard deviation of the gusts along and across it; upwards half of that", 0.0, 10.0);
    v("gust_s", gust_s, "s", "correlation time of the gusts: Dryden's length over the airspeed", 0.05, 60.0);
  }
};

class Wind {
 public:
  Wind(const WindOptions& options, std::uint64_t seed);

  /// The wind after one more step; it fades towards the floor.
  Vec3 step(double dt_s, double height_m);

 private:
  /// White noise filtered once and twice by 1 / (1 + T s).
  struct Filter {
    double once = 0, twice = 0;
  };

  WindOptions options_;
  Rng rng_;
  Vec3 along_W_, across_W_;
  std::array<Filter, 3> filters_;
};

}  // namespace fbvins
