// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/sensor_station.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "fbvins/sim/rotor_shake.hpp"

namespace fbvins {
namespace sensor_station_test {

SimulationOptions quick() {
  SimulationOptions options = *simulation_preset("normal");
  options.camera.time_samples = 1;
  options.camera.drop_share = 0.3;
  return options;
}

MotionState at_rest() {
  MotionState m;
  m.T_WB.p = Vec3(0, 0, 1);
  return m;
}

Result<SensorStation> station(const SimulationOptions& options) {
  const std::vector<Vec3> path{{-1, -1, 1}, {1, 1, 1}};
  return SensorStation::create(options, room_around(path, 2, 3), path);
}

// The models are those of a recording: along the same flight, an IMU without rotors gives the same readings, and the
// cameras the same images.
TEST(SensorStation, AgreesWithARecordingOfTheSameFlight) {
  SimulationOptions options = quick();
  options.flight.duration_s = 3;
  options.imu.vibration_accel_mps2 = options.imu.vibration_gyro_radps = 0;
  options.imu.rumble_accel_mps2_rthz = options.imu.rumble_gyro_radps_rthz = 0;
  auto recording = prepare_simulation(options);
  ASSERT_TRUE(recording);
  const SplineTrajectory& flight = recording->flight;
  std::vector<Vec3> path;
  for (double t = 0; t < flight.duration_s(); t += 0.1) path.push_back(flight.pose(t).p);
  auto asked = SensorStation::create(options, recording->world->plan, path);
  ASSERT_TRUE(asked);
  for (std::size_t i = 0; i < recording->imu.samples.size(); ++i) {
    const ImuSample reading = asked->read_imu(flight.at(static_cast<double>(i) / 200), {1, 1, 1, 1});
    ASSERT_EQ(reading.t, recording->imu.samples[i].t);
    ASSERT_EQ(reading.accel_mps2, recording->imu.samples[i].accel_mps2) << i;
    ASSERT_EQ(asked->truth().bias.gyro_radps, recording->imu.truth[i].bias.gyro_radps);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const RenderedFrame a = asked->render([&](double t) { return flight.at(t); }), b = render_frame(*recording, i);
    EXPECT_EQ(a.frame.t, b.frame.t);
    EXPECT_EQ(a.right_stamp, b.right_stamp);
    EXPECT_TRUE(std::equal(a.frame.left()->row(0), a.frame.left()->row(480), b.frame.left()->row(0)));
    EXPECT_TRUE(std::equal(a.frame.right()->row(0), a.frame.right()->row(480), b.frame.right()->row(0)));
  }
}

TEST(SensorStation, VibratesWithTheRotors) {
  auto asked = station(quick());
  ASSERT_TRUE(asked) << asked.error().message;
  const auto spread = [&](double rotors) {
    Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
    const int n = 400;
    for (int i = 0; i < n; ++i) {
      const Vec3 a = asked->read_imu(at_rest(), {rotors, rotors, rotors, rotors}).accel_mps2;
      sum += a;
      squares += a.cwiseAbs2();
    }
    return std::sqrt((squares / n - (sum / n).cwiseAbs2()).sum() / 3);
  };
  const double still = spread(0), hover = spread(1), fast = spread(1.4);
  EXPECT_LT(still, 0.06);
  EXPECT_GT(hover, 0.3);
  EXPECT_GT(fast, 1.5 * hover);
}

TEST(RotorShake, ItsToneIsThatOfTheRotors) {
  const double share = 0.9, rate_hz = 1000;
  const auto strength = [&](double hz) {
    RotorShake shake(3);
    std::complex<double> sum;
    for (int i = 0; i < 2000; ++i) {
      const Shake s = shake.step({share, share, share, share}, 1 / rate_hz);
      sum += s.power * s.accel.x() * std::polar(1.0, -2 * std::numbers::pi * hz * i / rate_hz);
    }
    return std::abs(sum) / 2000;
  };
  const double tone = strength(RotorShake::kHover_hz * share);
  EXPECT_GT(tone, 0.1);
  EXPECT_GT(strength(2 * RotorShake::kHover_hz * share), 0.05 * tone);
  EXPECT_LT(strength(1.25 * RotorShake::kHover_hz * share), 0.02 * tone);
}

TEST(RotorShake, HasUnitVarianceInHover) {
  double squares = 0;
  const int n = 4000, seeds = 20;
  for (int seed = 0; seed < seeds; ++seed) {
    RotorShake shake(static_cast<std::uint64_t>(seed));
    for (int i = 0; i < n; ++i) squares += shake.step({1.02, 0.97, 1.01, 0.99}, 0.005).accel.squaredNorm() / 3;
  }
  EXPECT_NEAR(squares / n / seeds, 1, 0.1);
}

TEST(SensorStation, FramesGetLostAsInARecording) {
  auto asked = station(quick());
  ASSERT_TRUE(asked);
  EXPECT_GT(asked->longest_exposure_s(), 0);
  std::vector<double> intervals;
  double last = asked->next_image_s();
  for (int i = 0; i < 8; ++i) {
    (void)asked->render([](double) { return at_rest(); });
    intervals.push_back(asked->next_image_s() - last);
    last = asked->next_image_s();
  }
  EXPECT_GT(*std::max_element(intervals.begin(), intervals.end()), 0.09);
  EXPECT_NEAR(*std::min_element(intervals.begin(), intervals.end()), 0.05, 1e-9);
}

}  // namespace sensor_station_test
}  // namespace fbvins
