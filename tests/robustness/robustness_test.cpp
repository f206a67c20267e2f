// SPDX-License-Identifier: Apache-2.0
// A flight whose sensors fail on the way, a real one and a simulated one: it goes on, and the health column says what happened.
// Also checks the accuracy of whole runs, for all frontends, and online calibration.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/robustness/altered_recording.hpp"

namespace fbvins::test {
namespace robustness_test {

/// The recording, and when its sensors fail, in full motion.
struct Recording {
  bool real;
  double fails_s;
};
constexpr Recording kReal{true, 6.0}, kSimulated{false, 5.0};

std::shared_ptr<const Image> brightened(const Image& image, double factor) {
  auto out = std::make_shared<Image>(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      out->at(x, y) = static_cast<std::uint8_t>(std::clamp(factor * image.at(x, y) + 0.5, 0.0, 255.0));
  return out;
}

class Flight : public testing::TestWithParam<std::tuple<Recording, const char*>> {
 protected:
  void SetUp() override {
    if (std::filesystem::exists(path())) return;
    if (recording().real) GTEST_SKIP() << path() << " is not there; set FBVINS_DATA";
    FAIL() << path() << " is not there; ctest renders it (simulated_flight)";
  }

  const Recording& recording() const { return std::get<0>(GetParam()); }
  std::string frontend() const { return std::get<1>(GetParam()); }
  std::filesystem::path path() const { return recording().real ? real_recording("MH_01_easy_17s") : simulated_recording(); }
  bool within(double t_s, double length_s) const { return t_s >= recording().fails_s && t_s < recording().fails_s + length_s; }
  int count_during(const Flown& flown, HealthState state, double length_s) const {
    return flown.count(state, recording().fails_s, recording().fails_s + length_s);
  }

  /// Runs the recording with changed events, and prints a summary.
  Flown fly_altered(const Alter& alter) {
    Flown flown = fly(path(), config_for(frontend()), alter);
    std::printf("%s: %s\n", testing::UnitTest::GetInstance()->current_test_info()->name(), flown.text().c_str());
    return flown;
  }
  /// No restart, a pose for every image, `good` again soon afterwards, and no pose that is `good` and far off.
  void expect_recovered(const Flown& flown, double length_s, double bound_m, double settle_s = 0.5) {
    const double end_s = recording().fails_s + length_s + settle_s;
    EXPECT_EQ(flown.resets(), 0u);
    EXPECT_EQ(flown.count(HealthState::lost, 0, 1e9), 0);
    EXPECT_GT(flown.count(HealthState::good, end_s, 1e9), 0);
    EXPECT_EQ(flown.count(HealthState::degraded, end_s, 1e9), 0);
    EXPECT_LT(flown.rmse_m(end_s), bound_m);
    EXPECT_LT(flown.largest_error_of_good_m(), 2.5 * bound_m);
  }
};

TEST_P(Flight, ASecondWithoutImages) {
  const Flown flown =
      fly_altered([&](double t_s, SensorEvent& e) { return !std::holds_alternative<StereoFrame>(e) || !within(t_s, 1.0); });
  expect_recovered(flown, 1.0, 0.05);
}

TEST_P(Flight, ASecondOfFramesWithoutImages) {
  const Flown flown = fly_altered([&](double t_s, SensorEvent& e) {
    if (auto* frame = std::get_if<StereoFrame>(&e); frame && within(t_s, 1.0)) frame->images.clear();
    return true;
  });
  EXPECT_GT(count_during(flown, HealthState::degraded, 1.0), 15);
  for (const Odometry& o : flown.odometry) {
    if (!within(flown.time_s(o), 1.0)) continue;
    EXPECT_EQ(o.health.reason, HealthReason::no_images) << flown.time_s(o);
  }
  expect_recovered(flown, 1.0, 0.05);
}

TEST_P(Flight, HalfASecondWithoutReadings) {
  const Flown flown =
      fly_altered([&](double t_s, SensorEvent& e) { return !std::holds_alternative<ImuSample>(e) || !within(t_s, 0.5); });
  EXPECT_GT(count_during(flown, HealthState::degraded, 0.6), 5);
  expect_recovered(flown, 0.5, 0.03);
}

TEST_P(Flight, ThreeSecondsOfABlackRightCamera) {
  const Flown flown = fly_altered([&](double t_s, SensorEvent& e) {
    if (auto* frame = std::get_if<StereoFrame>(&e); frame && within(t_s, 3.0))
      frame->set_image(1, std::make_shared<Image>(752, 480));
    return true;
  });
  EXPECT_GT(count_during(flown, HealthState::degraded, 3.0), 50);
  expect_recovered(flown, 3.0, 0.03);
}

TEST_P(Flight, ThreeSecondsOfABlackLeftCamera) {
  const Flown flown = fly_altered([&](double t_s, SensorEvent& e) {
    if (auto* frame = std::get_if<StereoFrame>(&e); frame && within(t_s, 3.0))
      frame->set_image(0, std::make_shared<Image>(752, 480));
    return true;
  });
  EXPECT_EQ(flown.count(HealthState::good, recording().fails_s + 0.3, recording().fails_s + 2.9), 0);
  // Both frontends follow features in the left image: three seconds on the IMU alone.
  const double end_s = recording().fails_s + 4.0;
  const auto later =
      std::count_if(flown.odometry.begin(), flown.odometry.end(), [&](const Odometry& o) { return flown.time_s(o) >= end_s; });
  EXPECT_GT(flown.count(HealthState::good, end_s, 1e9),
            0.9 * flown.count(HealthState::degraded, end_s, 1e9) + 0.7 * static_cast<double>(later));
  EXPECT_LE(flown.resets(), 1u);
}

TEST_P(Flight, TwoSecondsTenTimesAsBright) {
  const Flown flown = fly_altered([&](double t_s, SensorEvent& e) {
    if (auto* frame = std::get_if<StereoFrame>(&e); frame && within(t_s, 2.0))
      frame->set_image(0, brightened(*frame->left(), 10)), frame->set_image(1, brightened(*frame->right(), 10));
    return true;
  });
  expect_recovered(flown, 2.0, 0.05);
}

TEST_P(Flight, TwoSecondsATenthAsBright) {
  const Flown flown = fly_altered([&](double t_s, SensorEvent& e) {
    if (auto* frame = std::get_if<StereoFrame>(&e); frame && within(t_s, 2.0))
      frame->set_image(0, brightened(*frame->left(), 0.1)), frame->set_image(1, brightened(*frame->right(), 0.1));
    return true;
  });
  expect_recovered(flown, 2.0, 0.05);
}

TEST_P(Flight, IsAsAccurateAsPromised) {
  const Flown flown = fly_altered(nullptr);
  EXPECT_LT(flown.rmse_m(), frontend() == "klt" ? 0.008 : 0.010);
  EXPECT_GE(flown.with_pose(), 0.94 * flown.images);
  for (const Odometry& o : flown.odometry)
    if (o.health.has_pose()) {
      EXPECT_LE(flown.time_s(o), 1.0) << "first pose";
      break;
    }
  EXPECT_EQ(flown.resets(), 0u);
  EXPECT_EQ(flown.count(HealthState::lost, 0, 1e9), 0);
}

TEST_P(Flight, OneCameraAloneIsEnough) {
  for (const bool right : {false, true}) {
    const Alter alone = [&](double, SensorEvent& event) {
      if (auto* frame = std::get_if<StereoFrame>(&event)) {
        if (right) frame->set_image(0, frame->right());
        frame->set_image(1, nullptr);
      }
      return true;
    };
    const Flown flown = fly(path(), config_for(frontend()), alone, [&](StereoRig& rig) { rig = with_one_camera(rig, right); });
    std::printf("%s: %s\n", right ? "right" : "left", flown.text().c_str());
    EXPECT_LT(flown.rmse_m(), recording().real ? 0.012 : 0.08);
    EXPECT_EQ(flown.resets(), 0u);
    EXPECT_EQ(flown.count(HealthState::lost, 0, 1e9), 0);
    // At rest one camera waits; the simulated flight rests for three seconds.
    EXPECT_GT(flown.with_pose(), (recording().real ? 0.8 : 0.5) * flown.images);
  }
}

TEST_P(Flight, StaysAtRest) {
  const auto folder = recording().real ? real_recording("V1_01_easy_rest_3s") : simulated_recording();
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there; set FBVINS_DATA";
  const Flown flown =
      fly(folder, config_for(frontend()), [&](double t_s, SensorEvent&) { return recording().real || t_s < 2.9; });
  ASSERT_GT(flown.with_pose(), 40);
  std::optional<Vec3> first;
  for (const Odometry& o : flown.odometry) {
    if (!o.health.has_pose()) continue;
    if (!first) first = o.T_WB.p;
    EXPECT_LT((o.T_WB.p - *first).norm(), 0.005);
  }
}

TEST_P(Flight, CalibrationIsRefinedInFlight) {
  const Quat turn = so3_exp(0.0349 * Vec3(0.6, -0.5, 0.62).normalized());
  const Vec3 shift(0.006, -0.006, 0.005);
  StereoRig truth;
  const auto loosen = [&](StereoRig& rig) {
    truth = rig;
    rig.cameras[0].T_BC = {turn * rig.T_BC0().q, Vec3(turn * rig.T_BC0().p + shift)};
    rig.cameras[1].T_BC = {turn * rig.T_BC1().q, Vec3(turn * rig.T_BC1().p + shift)};
  };
  const auto wrong_rad = [&](const Flown& f) { return so3_log(truth.T_BC0().q.conjugate() * f.calibration.T_BC0().q).norm(); };
  SystemOptions config = config_for(frontend());
  const Flown off = fly(path(), config, nullptr, loosen);
  EXPECT_NEAR(wrong_rad(off), 0.0349, 1e-4);
  config.estimator.estimate_extrinsics = true;
  const Flown on = fly(path(), config, nullptr, loosen);
  std::printf("%s extrinsics 2 deg wrong: off %s\n  on %s\n  left over %.3f deg\n", frontend().c_str(), off.text().c_str(),
              on.text().c_str(), wrong_rad(on) * 180 / M_PI);
  EXPECT_LT(wrong_rad(on), 0.3 * 0.0349);
  // The trajectory need not gain: the estimated direction of gravity absorbs most of the rotation, and readings that a wrong
  // mounting contradicts count less (docs/derivations/integrity.md, I4c).
  EXPECT_LT(on.rmse_m(), 0.025);
}

// A constant offset of 5 ms, against which no option is set, and with the window's state as well.
TEST_P(Flight, TimeOffsetIsFoundInFlight) {
  const auto late = [](StereoRig& rig) { rig.time_offset_s += 0.005; };
  SystemOptions config = config_for(frontend());
  const Flown untouched = fly(path(), config);
  for (const bool in_window : {false, true}) {
    config.estimator.estimate_time_offset = in_window;
    const Flown flown = fly(path(), config, nullptr, late);
    std::printf("%s stamps 5 ms wrong%s: %s\n  offset found %.2f ms\n", frontend().c_str(), in_window ? ", a state" : "",
                flown.text().c_str(), 1e3 * flown.calibration.time_offset_s);
    // 70 % to 140 % of the 5 ms must be found in 17 s.
    EXPECT_LT(flown.calibration.time_offset_s, -0.0035);
    EXPECT_GT(flown.calibration.time_offset_s, -0.007);
    EXPECT_LT(flown.rmse_m(), 1.6 * untouched.rmse_m());
  }
}

std::string frontend_of(const testing::TestParamInfo<Flight::ParamType>& info) { return std::get<1>(info.param); }

INSTANTIATE_TEST_SUITE_P(Real, Flight, testing::Combine(testing::Values(kReal), testing::Values("klt", "orb", "boost")),
                         frontend_of);
INSTANTIATE_TEST_SUITE_P(Simulated, Flight, testing::Combine(testing::Values(kSimulated), testing::Values("klt", "orb", "boost")),
                         frontend_of);

}  // namespace robustness_test
}  // namespace fbvins::test
