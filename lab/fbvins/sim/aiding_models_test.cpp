// SPDX-License-Identifier: Apache-2.0
// Simulated flights with aiding sensors: what they read, and that the estimator uses them.
#include <gtest/gtest.h>

#include "fbvins/sim/pressure_model.hpp"
#include "fbvins/sim/simulation.hpp"
#include "fbvins/sim/velocity_model.hpp"

namespace fbvins {
namespace aiding_models_test {

const Simulation& flight() {
  static const Simulation made = [] {
    auto options = *simulation_preset("normal");
    options.flight.duration_s = 6;
    options.range.rate_hz = 20, options.velocity.rate_hz = 50, options.barometer.rate_hz = 25;
    return *prepare_simulation(options);
  }();
  return made;
}

TEST(AidingModels, ReadingsOfAllComeInOrder) {
  const Simulation& s = flight();
  EXPECT_TRUE(std::ranges::is_sorted(s.aiding, {}, [](const AidingSample& r) { return stamp_of(r); }));
  EXPECT_NEAR(static_cast<double>(readings_of<RangeSample>(s.aiding).size()), 20 * s.flight.duration_s(), 2);
  EXPECT_NEAR(static_cast<double>(readings_of<VelocitySample>(s.aiding).size()), 50 * s.flight.duration_s(), 2);
  EXPECT_NEAR(static_cast<double>(readings_of<PressureSample>(s.aiding).size()), 25 * s.flight.duration_s(), 2);
  for (const AidingSample& reading : s.aiding) EXPECT_EQ(impossible(reading), "");
}

TEST(AidingModels, AVelocityIsThatOfThePlaceOfTheSensor) {
  const Simulation& s = flight();
  VelocityModelOptions exact;
  exact.rate_hz = 40, exact.noise_mps = 0, exact.scale_error = 0, exact.vertical = true;
  for (const VelocitySample& r : simulate_velocities(s.flight, Mat3::Identity(), exact, s.start, 1)) {
    const double t = (r.t - s.start).seconds(), h = 1e-4;
    if (t < h || t > s.flight.duration_s() - h) continue;
    const Vec3 v_W = (s.flight.pose(t + h) * r.p_B - s.flight.pose(t - h) * r.p_B) / (2 * h);
    EXPECT_LT((s.flight.pose(t).q * r.v_mps - v_W).norm(), 1e-4) << t;
  }
}

TEST(AidingModels, PressureFallsWithTheHeight) {
  const Simulation& s = flight();
  PressureModelOptions exact;
  exact.rate_hz = 40, exact.noise_pa = 0, exact.drift_pa_rts = 0;
  const auto readings = simulate_pressures(s.flight, exact, s.start, 1);
  const double z0 = s.flight.pose(0).p.z();
  for (const PressureSample& r : readings)
    EXPECT_NEAR((readings.front().pressure_pa - r.pressure_pa) / 12.0, s.flight.pose((r.t - s.start).seconds()).p.z() - z0, 0.02);
}

}  // namespace aiding_models_test
}  // namespace fbvins
