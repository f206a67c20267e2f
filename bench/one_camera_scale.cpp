// SPDX-License-Identifier: Apache-2.0
// Whether the scale of flights with one camera is what the estimator says: simulated tracks and readings of a tenth to one
// metre of motion, poses called good whose speed is off by more than three of its standard deviations (and by 1 %).
//
//   one_camera_scale [flights] [first seed] [frames]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "fbvins/estimator/estimator.hpp"
#include "fbvins/estimator/mono_start.hpp"
#include "fbvins/estimator/simulated_flight.hpp"

using namespace fbvins;

int main(int argc, char** argv) {
  const int flights = argc > 1 ? std::atoi(argv[1]) : 100, first_seed = argc > 2 ? std::atoi(argv[2]) : 1,
            frames = argc > 3 ? std::atoi(argv[3]) : 300;
  int good = 0, wrong = 0, wrong_flights = 0, started = 0, restarts = 0;
  double start_s = 0, squares = 0, worst = 0;
  for (int seed = first_seed; seed < first_seed + flights; ++seed) {
    Rng rng(static_cast<std::uint64_t>(seed));
    const double amplitude_m = rng.uniform(0.1, 1.0), turn_rad = rng.uniform(0.05, 0.5);
    test::SimulatedFlight flight(test::Motion(amplitude_m, turn_rad), static_cast<std::uint64_t>(seed));
    flight.rig = with_one_camera(flight.rig);
    flight.right_camera = [](int) { return false; };
    Estimator estimator(flight.rig, EstimatorOptions{});
    int first = -1, wrong_here = 0;
    double scale = 0, sigma = 0;
    std::uint32_t resets = 0;
    for (int k = 0; k < frames; ++k) {
      const Odometry o = estimator.process(flight.frame(k)).odometry;
      resets = o.reset_counter;
      if (o.health.state != HealthState::good) continue;
      if (first < 0) first = k;
      const double speed = flight.truth(k).v_FB.norm();
      if (speed < 0.1) continue;
      ++good;
      const double error = o.v_WB.norm() / speed - 1;
      scale = o.v_WB.norm() / speed, sigma = scale_sigma_of(o.v_WB, o.velocity_covariance);
      squares += error * error / (sigma * sigma);
      const bool off = std::abs(error) > 3 * sigma && std::abs(error) > 0.01;
      wrong_here += off;
      if (off) worst = std::max(worst, std::abs(error) / sigma);
    }
    wrong += wrong_here, wrong_flights += wrong_here > 0, restarts += static_cast<int>(resets);
    if (first >= 0) ++started, start_s += first / flight.image_rate_hz;
    fmt::print("seed {}: {:.2f} m, {:.2f} rad, first good {:.2f} s, last scale {:.3f} +- {:.3f}, {} wrong, {} resets\n", seed,
               amplitude_m, turn_rad, first / flight.image_rate_hz, scale, sigma, wrong_here, resets);
  }
  fmt::print(
      "{} flights of {:.0f} s: {} started, after {:.2f} s in the mean; {} good poses, scale NEES {:.2f} (1), {} off by more than 3 sigma in {} flights, worst {:.1f} sigma; {} resets\n",
      flights, frames / 20.0, started, start_s / std::max(1, started), good, squares / std::max(1, good), wrong, wrong_flights,
      worst, restarts);
  return wrong > 0 ? 1 : 0;
}
