// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/recorded_flight.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/flight.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {
namespace recorded_flight_test {

struct Recording {
  SplineTrajectory flight;
  SimulatedImu imu;
  std::vector<TrajectoryPoint> points;  ///< 100 Hz, with the noise of motion capture
};

Recording record(double position_noise_m) {
  Recording r;
  FlightOptions options;
  options.duration_s = 20;
  r.flight = make_flight(options, body_in_vehicle(euroc_rig(), 5), {}, 6);
  r.imu = simulate_imu(r.flight, {}, {}, Time{5'000'000'000}, 6);
  Rng rng(3);
  for (std::size_t i = 0; i < r.imu.truth.size(); i += 2) {
    TrajectoryPoint p{r.imu.truth[i].t, r.imu.truth[i].T_WB, {}, {}};
    p.T_WB.p += position_noise_m * Vec3(rng.normal(), rng.normal(), rng.normal());
    r.points.push_back(p);
  }
  return r;
}

TEST(RecordedFlight, BlendKeepsTheSlowOfOneAndTheFastOfTheOther) {
  std::vector<Vec3> y, c, slow, fast;
  const double dt = 0.005;
  for (int k = 0; k < 4000; ++k) {
    slow.emplace_back(std::sin(2 * M_PI * 0.05 * k * dt), 0, 0);
    fast.emplace_back(0.01 * std::sin(2 * M_PI * 12 * k * dt), 0, 0);
  }
  for (std::size_t k = 0; k < slow.size(); ++k) {
    y.push_back(slow[k]);  // without the fast part
    const std::size_t a = k > 0 ? k - 1 : k, b = k + 1 < slow.size() ? k + 1 : k;
    const double drift = 1e-7;  // a constant error of the acceleration
    c.push_back((slow[a] + fast[a] - 2 * (slow[k] + fast[k]) + slow[b] + fast[b]) + Vec3(drift, 0, 0));
  }
  const std::vector<Vec3> x = blend_second_differences(y, c, std::pow(2 * M_PI * 1.0 * dt, -4));
  for (std::size_t k = 400; k + 400 < x.size(); ++k) EXPECT_NEAR(x[k].x(), (slow[k] + fast[k]).x(), 5e-4) << k;
}

TEST(RecordedFlight, WithItsImuTheFlightIsFoundAgain) {
  const Recording r = record(0.002);
  const auto again = fly_again(r.points, r.imu.samples, 1.0);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->imu.samples[100].accel_mps2,
            r.imu.samples[100 + (again->start.ns - r.imu.samples[0].t.ns) / 5'000'000].accel_mps2);
  for (double t = 1; t < 18; t += 0.3) {
    const MotionState m = again->flight.at(t), truth = r.flight.at(t + (again->start - r.imu.samples[0].t).seconds());
    EXPECT_LT((m.T_WB.p - truth.T_WB.p).norm(), 0.004) << t;
    EXPECT_LT((m.v_WB - truth.v_WB).norm(), 0.03) << t;
    EXPECT_LT(m.T_WB.q.angularDistance(truth.T_WB.q), 0.01) << t;
  }
  // The biases explain the readings, so they are near those that made them.
  for (std::size_t i = 400; i < 3000; i += 200) {
    EXPECT_LT((again->imu.truth[i].bias.gyro_radps - r.imu.truth[i].bias.gyro_radps).norm(), 0.02);
    EXPECT_LT((again->imu.truth[i].bias.accel_mps2 - r.imu.truth[i].bias.accel_mps2).norm(), 0.3);
  }
}

TEST(RecordedFlight, AloneItIsSmoothed) {
  const Recording r = record(0.002);
  const auto again = fly_again(r.points, 1.0);
  ASSERT_TRUE(again);
  for (double t = 1; t < 18; t += 0.3) {
    EXPECT_LT((again->flight.at(t).T_WB.p - r.flight.at(t).T_WB.p).norm(), 0.01) << t;
    EXPECT_LT((again->flight.at(t).a_WB - r.flight.at(t).a_WB).norm(), 1.0) << t;
  }
}

TEST(RecordedFlight, TooShortIsRefused) {
  Recording r = record(0);
  r.points.resize(50);
  EXPECT_FALSE(fly_again(r.points, 1.0));
  EXPECT_FALSE(fly_again(r.points, r.imu.samples, 1.0));
  EXPECT_FALSE(fly_again({}, 1.0));
}

}  // namespace recorded_flight_test
}  // namespace fbvins
