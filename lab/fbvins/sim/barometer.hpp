// SPDX-License-Identifier: Apache-2.0
// A barometer's height: white noise, and a random walk for weather and temperature. One owner.
//
//   Barometer barometer(options, seed);
//   double height_m = barometer.read(true_height_m);   // every 1 / Barometer::kRate_hz seconds
#pragma once

#include <cmath>
#include <cstdint>

#include "fbvins/core/rng.hpp"

namespace fbvins {

struct BarometerModelOptions {
  double noise_m = 0.08;
  double wander_m_rts = 0.02;

  template <class V>
  void visit(V&& v) {
    v("noise_m", noise_m, "m", "standard deviation of a reading", 0.0, 10.0);
    v("wander_m_rts", wander_m_rts, "m/sqrt(s)", "random walk of its zero", 0.0, 10.0);
  }
};

class Barometer {
 public:
  static constexpr double kRate_hz = 50;

  Barometer(const BarometerModelOptions& options, std::uint64_t seed) : options_(options), rng_(seed, 72) {
    zero_m_ = rng_.uniform(-50, 50);  // the absolute height is unknown
  }
  double read(double true_height_m) {
    zero_m_ += options_.wander_m_rts / std::sqrt(kRate_hz) * rng_.normal();
    return true_height_m + zero_m_ + options_.noise_m * rng_.normal();
  }

 private:
  BarometerModelOptions options_;
  Rng rng_;
  double zero_m_ = 0;
};

}  // namespace fbvins
