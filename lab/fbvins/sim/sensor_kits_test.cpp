// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/sensor_kits.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/camera/check_rig.hpp"
#include "fbvins/core/options.hpp"
#include "fbvins/sim/frame_times.hpp"
#include "fbvins/sim/image_sensor.hpp"

namespace fbvins {
namespace sensor_kits_test {

SimulationOptions with_sensors(const std::string& name) {
  SimulationOptions options = *simulation_preset("handheld");
  EXPECT_TRUE(use_sensors(options, name)) << name;
  options.flight.duration_s = 3;
  return options;
}

TEST(SensorKits, EachIsARigThatCanBeFlownWith) {
  for (const std::string& name : sensor_kits()) {
    const SimulationOptions options = with_sensors(name);
    ASSERT_TRUE(validate(options)) << name << ": " << validate(options).error().message;
    EXPECT_EQ(options.sensors, name);
    const Result<StereoRig> rig = simulated_rig(options);
    ASSERT_TRUE(rig) << name;
    EXPECT_TRUE(check_rig(*rig, name));
    EXPECT_TRUE(check_rig(calibrated_rig(options, *rig), name));
    EXPECT_NEAR(rig->T_BC0().R().determinant(), 1, 1e-12) << name;
    EXPECT_EQ(rig->has_right(), name == "d435i" || name == "oak-d" || name == "adis16448") << name;
  }
  SimulationOptions options;
  EXPECT_FALSE(use_sensors(options, "theodolite"));
  EXPECT_EQ(options.sensors, "none");
}

TEST(SensorKits, TheCalibrationOfAUserDoesNotKnowOffsetAndLineDelay) {
  const SimulationOptions options = with_sensors("l515");
  const StereoRig rig = *simulated_rig(options), calibrated = calibrated_rig(options, rig);
  EXPECT_DOUBLE_EQ(rig.time_offset_s, -0.05);
  EXPECT_NEAR(rig.line_delay_s, 0.028 / 360, 1e-12);
  EXPECT_EQ(calibrated.time_offset_s, 0);
  EXPECT_EQ(calibrated.line_delay_s, 0);
  EXPECT_NE(rig.left().distortion()[0], 0);
  EXPECT_EQ(calibrated.left().distortion()[0], 0);
  const double turned = so3_log((rig.T_BC0().q.conjugate() * calibrated.T_BC0().q).normalized()).norm();
  EXPECT_GT(turned, 1e-4);
  EXPECT_LT(turned, 0.05);
}

TEST(SensorKits, WithoutErrorsTheCalibrationIsTheRig) {
  SimulationOptions options;
  options.camera.time_offset_ms = 7, options.camera.line_delay_us = 30;
  const StereoRig rig = *simulated_rig(options), calibrated = calibrated_rig(options, rig);
  EXPECT_EQ(calibrated.time_offset_s, rig.time_offset_s);
  EXPECT_EQ(calibrated.line_delay_s, rig.line_delay_s);
  EXPECT_EQ(calibrated.left().intrinsics(), rig.left().intrinsics());
  EXPECT_EQ(calibrated.T_BC0().p, rig.T_BC0().p);
}

TEST(SensorKits, IntervalsChangeWithTheExposure) {
  SimulationOptions options = with_sensors("l515");
  options.camera.interval_for_s = 0.5;
  FrameTimes frames(options);
  const ImageIntervals intervals(options);
  std::vector<int> seen(4, 0);
  double last = frames.next_s();
  EXPECT_DOUBLE_EQ(last, kMargin_s);
  for (int i = 0; i < 400; ++i) {
    EXPECT_NEAR(intervals.longer(last), intervals.at(last) / 0.03317, 1e-9);
    frames.advance();
    const double step_ms = 1e3 * (frames.next_s() - last);
    last = frames.next_s();
    const double known_ms[] = {33.17, 40.05, 50.01, 59.96};
    const auto* at = std::ranges::min_element(known_ms, {}, [&](double ms) { return std::abs(ms - step_ms); });
    EXPECT_NEAR(*at, step_ms, 1e-6);
    ++seen[static_cast<std::size_t>(at - known_ms)];
  }
  for (const int n : seen) EXPECT_GT(n, 20);
  options.camera.intervals_ms = "33,fast";
  const auto wrong = prepare_simulation(options);
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find("'fast' is no interval"), std::string::npos) << wrong.error().message;
}

TEST(SensorKits, LongerIntervalsAllowLongerExposuresAndGainHasSteps) {
  CameraModelOptions options;
  options.gain_step_db = 3, options.glare = 0;
  const Camera camera(PinholeRadtan{40, 40, 15.5, 11.5, 0, 0, 0, 0}, 32, 24);
  ImageSensor sensor(options, camera, 1, 1);
  const std::vector<float> dim(32 * 24, 0.12F);
  sensor.settle(dim);
  const double gain = sensor.gain(), steps = 20 * std::log10(gain) / 3;
  EXPECT_DOUBLE_EQ(sensor.exposure_s(), 5e-3);
  EXPECT_GT(gain, 1.5);
  EXPECT_NEAR(steps, std::round(steps), 1e-9);
  sensor.allow_longer(1.5);
  EXPECT_DOUBLE_EQ(sensor.exposure_s(), 7.5e-3);
  EXPECT_LT(sensor.gain(), gain);
}

/// Each line where the camera is when it is read: the last line of a slow readout is the first one of a fast one later.
TEST(SensorKits, ARollingShutterFollowsMotionThatChanges) {
  const auto row_of = [](double readout_s, double t_s, int row) {
    SimulationOptions options = with_sensors("l515");
    options.camera.line_delay_us = 1e6 * readout_s / 360, options.camera.auto_exposure = false;
    options.camera.shot_noise = options.camera.read_noise = 0,
    options.camera.min_exposure_ms = options.camera.max_exposure_ms = 0.05;
    options.camera.sensitivity = 2000, options.camera.time_samples = 8;
    auto simulation = prepare_simulation(options);
    EXPECT_TRUE(simulation);
    simulation->frames = {simulation->start + Duration::from_seconds(t_s)};
    const auto image = render_frame(*simulation, 0).frame.left();
    return std::vector<int>(image->row(row), image->row(row) + image->width());
  };
  const auto difference = [](const std::vector<int>& a, const std::vector<int>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
    return sum / static_cast<double>(a.size());
  };
  const double late_s = 0.072 * (356.5 - 180) / 360;  // of line 356 in a readout of 72 ms
  const std::vector<int> rolled = row_of(0.072, 1.5, 356);
  EXPECT_LT(difference(rolled, row_of(1e-5, 1.5 + late_s, 356)), 3);
  EXPECT_GT(difference(rolled, row_of(1e-5, 1.5, 356)), 6);
}

TEST(SensorKits, StampsAreNoisyAndInOrder) {
  SimulationOptions options = with_sensors("arducam-fc");
  options.camera.stamp_noise_us = 9000, options.imu.stamp_jitter_us = 3000;
  const auto simulation = prepare_simulation(options);
  ASSERT_TRUE(simulation);
  double sum2 = 0;
  Time last{0};
  for (std::size_t i = 0; i < simulation->frames.size(); ++i) {
    const Duration error = stamp_error(options, static_cast<std::int64_t>(i));
    sum2 += std::pow(error.seconds(), 2);
    EXPECT_GT(simulation->frames[i] + error, last);
    last = simulation->frames[i] + error;
  }
  EXPECT_GT(std::sqrt(sum2 / static_cast<double>(simulation->frames.size())), 4e-3);
  for (std::size_t i = 1; i < simulation->imu.samples.size(); ++i)
    EXPECT_GT(simulation->imu.samples[i].t, simulation->imu.samples[i - 1].t);
  EXPECT_NE(simulation->imu.samples[5].t, simulation->imu.truth[5].t);
}

TEST(SensorKits, ADatasetHasTheNoisyStampsAndTheUsersCalibration) {
  SimulationOptions options = with_sensors("arducam-fc");
  options.flight.duration_s = 2, options.image_rate_hz = 2, options.camera.time_samples = 1;
  auto contents = simulate(options);
  ASSERT_TRUE(contents) << contents.error().message;
  EXPECT_EQ(contents->rig.time_offset_s, 0);
  const std::vector<FrameEntry> entries = contents->frames;
  Dataset data(*std::move(contents), {});
  std::size_t frames = 0;
  while (auto event = data.next())
    if (const auto* frame = std::get_if<StereoFrame>(&*event)) {
      EXPECT_EQ(frame->t, entries[frames].t);
      ++frames;
    }
  EXPECT_EQ(frames, entries.size());
}

}  // namespace sensor_kits_test
}  // namespace fbvins
