// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/initialiser.hpp"

#include <gtest/gtest.h>

#include "fbvins/geometry/heading.hpp"
#include "tests/support/simulated_flight.hpp"

namespace fbvins {
namespace initialiser_test {

using test::Motion;
using test::SimulatedFlight;

/// The first solution within `frames` frames, and the frame it came with.
struct Started {
  std::optional<InitialSolution> solution;
  int frame = -1;
  HealthReason reason = HealthReason::none;
};

Started start(SimulatedFlight& flight, int frames, const std::optional<Pose<G, B>>& origin = {}, double rest_s_a_frame = 0,
              const StandingOptions& standing = {}) {
  EstimatorOptions options;
  options.standing = standing;
  Initialiser initialiser(options, flight.rig.imu_noise);
  const Calibration calibration{{flight.rig.T_BC0(), flight.rig.T_BC(1)}};
  Started out;
  for (int k = 0; k < frames && !out.solution; ++k) {
    out.solution = initialiser.process(flight.frame(k), Duration::from_seconds(rest_s_a_frame * k), calibration, origin);
    out.frame = k;
  }
  out.reason = initialiser.reason();
  return out;
}

TEST(Initialiser, StartsInMotion) {
  SimulatedFlight flight(Motion(0.6, 0.3), 51);
  const Started s = start(flight, 40);
  ASSERT_TRUE(s.solution.has_value());
  EXPECT_FALSE(s.solution->from_rest);
  EXPECT_EQ(s.solution->states.size(), s.solution->frames.size());
  EXPECT_EQ(s.solution->frames.back().id, FrameId{s.frame});
  const NavState<G>& first = s.solution->states.front();
  const NavState<G>& last = s.solution->states.back();
  const NavState<W> from = flight.truth(static_cast<int>(s.solution->frames.front().id.value)), to = flight.truth(s.frame);
  EXPECT_NEAR((last.T_FB.p - first.T_FB.p).norm(), (to.T_FB.p - from.T_FB.p).norm(), 0.05);
  EXPECT_NEAR(last.v_FB.norm(), to.v_FB.norm(), 0.2);
  const Vec3 up_error = last.T_FB.q.conjugate() * Vec3::UnitZ() - to.T_FB.q.conjugate() * Vec3::UnitZ();
  EXPECT_LT(up_error.norm(), 0.05);
  EXPECT_LT((last.bias.gyro_radps - flight.bias.gyro_radps).norm(), 0.02);
}

TEST(SpacedFrames, HoldTheNewestWithTheReadingsBetweenThem) {
  SimulatedFlight flight(Motion(0.6, 0.3), 53);  // 20 images a second
  SpacedFrames frames;
  for (int k = 0; k < 40; ++k) {
    EXPECT_EQ(frames.full(), k >= 18) << k;  // nine that are 0.1 s apart, and the newest
    frames.add(flight.frame(k), 0.12);
  }
  EXPECT_EQ(frames.all().back().id, FrameId{39});
  for (std::size_t i = 1; i < frames.all().size(); ++i) {
    const TrackedFrame &before = frames.all()[i - 1], &frame = frames.all()[i];
    EXPECT_EQ(frame.imu.samples.front().t, before.t);
    EXPECT_EQ(frame.imu.samples.back().t, frame.t);
    if (i + 1 < frames.all().size()) {
      EXPECT_NEAR((frame.t - before.t).seconds(), 0.1, 1e-6);
    }
  }
}

// A second of strong motion is enough for one camera, of a gentle one two are needed.
TEST(Initialiser, OneCameraStartsSoonInStrongMotion) {
  for (const bool strong : {true, false}) {
    SimulatedFlight flight(strong ? Motion(1.5, 1.5) : Motion(0.05, 0.05), 54);
    Initialiser initialiser({}, flight.rig.imu_noise, {}, true);
    const Calibration calibration{{flight.rig.T_BC0(), flight.rig.T_BC(1)}};
    int first = -1;
    for (int k = 0; k < 40 && first < 0; ++k)
      if (initialiser.process(flight.frame(k), {}, calibration, {})) first = k;
    if (strong) {
      EXPECT_GE(first, 9);
      EXPECT_LT(first, 20);
    } else {
      EXPECT_GE(first, 33);
    }
  }
}

TEST(Initialiser, StartsFromRest) {
  SimulatedFlight flight(Motion(0, 0), 52);
  const Started s = start(flight, 40, {}, 0.05);
  ASSERT_TRUE(s.solution.has_value());
  EXPECT_TRUE(s.solution->from_rest);
  EXPECT_LT((s.solution->states.back().bias.gyro_radps - flight.bias.gyro_radps).norm(), 5e-3);
  EXPECT_TRUE(s.solution->states.back().v_FB.isZero());
}

TEST(Initialiser, AVehicleThatStandsLevelKnowsItsTiltAndTheBias) {
  SimulatedFlight flight(Motion(0, 0), 58);
  flight.bias.accel_mps2 = Vec3(0.2, -0.15, 0);
  const Vec3 up_B = flight.truth(0).T_FB.q.conjugate() * Vec3::UnitZ();
  const StandingOptions standing{.tilt_rad = 0.002, .up_x = up_B.x(), .up_y = up_B.y(), .up_z = up_B.z()};
  const auto tilt_error = [&](const Started& s) {
    return (s.solution->states.back().T_FB.q.conjugate() * Vec3::UnitZ() - up_B).norm();
  };
  const Started anyhow = start(flight, 40, {}, 0.05), level = start(flight, 40, {}, 0.05, standing);
  ASSERT_TRUE(anyhow.solution && level.solution);
  EXPECT_GT(tilt_error(anyhow), 0.02);
  EXPECT_LT(tilt_error(level), 0.001);
  EXPECT_LT(up_B.cross(level.solution->biases.bias.accel_mps2 - flight.bias.accel_mps2).norm(), 0.01);
  EXPECT_LT(up_B.unitOrthogonal().dot(level.solution->biases.accel_covariance * up_B.unitOrthogonal()), 0.021 * 0.021);

  const Started in_the_air = start(flight, 40, Pose<G, B>{}, 0.05, standing);
  ASSERT_TRUE(in_the_air.solution);
  EXPECT_GT(tilt_error(in_the_air), 0.02) << "a start that is not the first one may be in the air";
}

TEST(Initialiser, PutsTheFirstFrameAtTheOriginGiven) {
  SimulatedFlight flight(Motion(0.6, 0.3), 53);
  const Pose<G, B> origin(so3_exp(Vec3(0.1, -0.2, 2)), Vec3(10, -5, 3));
  const Started s = start(flight, 40, origin);
  ASSERT_TRUE(s.solution.has_value());
  const Pose<G, B>& first = s.solution->states.front().T_FB;
  EXPECT_LT((first.p - origin.p).norm(), 1e-9);
  EXPECT_LT(std::abs(heading_between(first.q, origin.q)), 1e-9);
}

TEST(Initialiser, WaitsForFeaturesInBothCameras) {
  SimulatedFlight flight(Motion(0.6, 0.3), 54);
  flight.right_camera = [](int) { return false; };
  const Started s = start(flight, 30);
  EXPECT_FALSE(s.solution.has_value());
  EXPECT_EQ(s.reason, HealthReason::too_few_features);
}

/// The frame with at most `most` features, all matched in stereo.
TrackedFrame with_features(TrackedFrame frame, std::size_t most) {
  std::erase_if(frame.features, [](const TrackedFeature& f) { return !f.by_several(); });
  frame.features.resize(std::min(most, frame.features.size()));
  return frame;
}

TEST(Initialiser, FewFeaturesAreEnoughAtRestAndNotInMotion) {
  for (const bool rests : {true, false}) {
    SimulatedFlight flight(rests ? Motion(0, 0) : Motion(0.6, 0.3), 56);
    Initialiser initialiser(EstimatorOptions{}, flight.rig.imu_noise);
    const Calibration calibration{{flight.rig.T_BC0(), flight.rig.T_BC(1)}};
    bool started = false;
    for (int k = 0; k < 40 && !started; ++k) {
      const TrackedFrame frame = with_features(flight.frame(k), 12);
      ASSERT_EQ(frame.features.size(), 12u);
      started = initialiser.process(frame, Duration::from_seconds(rests ? 0.05 * k : 0), calibration, std::nullopt).has_value();
    }
    EXPECT_EQ(started, rests);
  }
}

/// Somebody walks by: every third feature moves by two pixels an image.
TEST(Initialiser, AtRestLeavesOutMovingFeatures) {
  SimulatedFlight flight(Motion(0, 0), 57);
  flight.outlier = [](int k, std::int64_t id) { return id % 3 == 0 ? Vec2(2.0 * k, 0) : Vec2(0, 0); };
  const Started s = start(flight, 40, {}, 0.05);
  ASSERT_TRUE(s.solution.has_value());
  EXPECT_TRUE(s.solution->from_rest);
  for (const TrackedFrame& frame : s.solution->frames) {
    EXPECT_GT(frame.features.size(), 30u);
    for (const TrackedFeature& f : frame.features) EXPECT_NE(f.id.value % 3, 0);
  }
}

TEST(Initialiser, BeginsAnewAfterABreakInTheReadings) {
  SimulatedFlight flight(Motion(0.6, 0.3), 55);
  flight.readings = [](int k) { return k != 6; };
  const Started s = start(flight, 40);
  ASSERT_TRUE(s.solution.has_value());
  EXPECT_GE(s.solution->frames.front().id, FrameId{6});
}

}  // namespace initialiser_test
}  // namespace fbvins
