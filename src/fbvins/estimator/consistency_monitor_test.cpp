// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/consistency_monitor.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"
#include "tests/support/simulated_flight.hpp"

namespace fbvins {
namespace consistency_monitor_test {

const Duration kStep = Duration::from_seconds(0.05);
const Vec3 kBias(0.02, -0.01, 0.05);

ImuNoise assumed() {
  ImuNoise noise;
  noise.gyro_noise_density_radps_rthz = 4e-4;
  noise.accel_noise_density_mps2_rthz = 0.048;
  return noise;
}

/// Points before a stereo rig as it sees them from a pose, with noise of one standard deviation.
class Scene {
 public:
  explicit Scene(int points = 80) {
    for (int i = 0; i < points; ++i) points_.emplace_back(rng_.uniform(2, 6), rng_.uniform(-2, 2), rng_.uniform(-1.5, 1.5));
  }

  /// The points from `T_GB`; those from `first_other` on, from `other`, as if they moved; each camera from a pose of its own.
  std::vector<LandmarkObservation> seen(const Pose<G, B>& left, const Pose<G, B>& right, std::size_t first_other = 1000,
                                        const Pose<G, B>& other = {}) {
    features_.assign(points_.size(), {});
    std::vector<LandmarkObservation> out;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const bool moves = i >= first_other;
      features_[i].see(0, observe(rig.T_BC(0).inverse() * ((moves ? other : left).inverse() * points_[i])));
      features_[i].see(1, observe(rig.T_BC(1).inverse() * ((moves ? other : right).inverse() * points_[i])));
      out.push_back({points_[i], &features_[i]});
    }
    return out;
  }
  std::vector<LandmarkObservation> seen(const Pose<G, B>& T_GB) { return seen(T_GB, T_GB); }
  /// Every other point by a second pair of the same kind, each of its cameras from a pose of its own.
  std::vector<LandmarkObservation> seen_by_four(const Pose<G, B>& camera_2, const Pose<G, B>& camera_3) {
    std::vector<LandmarkObservation> out = seen({});
    calibration.cameras = {rig.T_BC(0), rig.T_BC(1), rig.T_BC(0), rig.T_BC(1)};
    for (std::size_t i = 0; i < points_.size(); i += 2) {
      features_[i] = {};
      features_[i].lead = 2;
      features_[i].see(2, observe(rig.T_BC(0).inverse() * (camera_2.inverse() * points_[i])));
      features_[i].see(3, observe(rig.T_BC(1).inverse() * (camera_3.inverse() * points_[i])));
    }
    return out;
  }

  StereoRig rig = test::SimulatedFlight(test::Motion(0.1, 0.1), 1).rig;
  Calibration calibration{{rig.T_BC0(), rig.T_BC(1)}};
  Time now;

 private:
  Observation observe(const Vec3& p_C) {
    constexpr double kFocal_px = 450;
    Observation o;
    o.sqrt_information = kFocal_px * Mat2::Identity();
    o.normalised = p_C.head<2>() / p_C.z() + Vec2(rng_.normal(), rng_.normal()) * 0.3 / kFocal_px;
    return o;
  }
  Rng rng_{3};
  std::vector<Vec3> points_;
  std::vector<TrackedFeature> features_;
};

Pose<G, B> turned(double rad) { return Pose<G, B>{so3_exp(Vec3(0, 0, rad)), Vec3::Zero()}; }
Pose<G, B> tilted(double rad) { return Pose<G, B>{so3_exp(Vec3(rad, 0, 0)), Vec3::Zero()}; }

TEST(ConsistencyMonitor, SaysNothingWhereImagesAndReadingsAgree) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  for (int k = 0; k < 100; ++k) {
    const ConsistencyMonitor::Verdict verdict = monitor.check(scene.seen({}), scene.calibration, turned(2e-4), kStep);
    EXPECT_FALSE(verdict.imu_contradicts || verdict.wrong);
  }
  EXPECT_FALSE(monitor.contradicted());
  EXPECT_TRUE(monitor.doubt({}).isZero(0));
}

TEST(ConsistencyMonitor, ReadingsThatTheImagesContradictCountAsMuchAsTheyAgree) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  const Pose<G, B> truth = turned(0.02);
  const ConsistencyMonitor::Verdict verdict = monitor.check(scene.seen(truth), scene.calibration, {}, kStep);
  ASSERT_TRUE(verdict.imu_contradicts);
  ASSERT_TRUE(verdict.seen);
  EXPECT_LT(so3_log((verdict.seen->q.conjugate() * truth.q).normalized()).norm(), 1e-3);
  EXPECT_NEAR(verdict.noise.gyro * assumed().gyro_noise_density_radps_rthz * std::sqrt(kStep.seconds()), 0.02, 1e-3);
  EXPECT_TRUE(monitor.contradicted());
}

TEST(ConsistencyMonitor, SmallContradictionsAddUp) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  int images = 0;
  while (images < 100 && !monitor.contradicted()) {
    (void)monitor.check(scene.seen(turned(0.005)), scene.calibration, {}, kStep);
    ++images;
  }
  EXPECT_GT(images, 1);
  EXPECT_LE(images, 6) << "0.3 s";
}

TEST(ConsistencyMonitor, WhatMovesAllInOneDirectionAddsUpSooner) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  int images = 0;
  while (images < 100 && !monitor.contradicted()) {
    (void)monitor.check(scene.seen(turned(0.0012)), scene.calibration, {}, kStep);
    ++images;
  }
  EXPECT_LE(images, 20) << "a second, for a turn of a quarter of a pixel's standard deviation";
}

TEST(ConsistencyMonitor, OneCameraThatContradictsTheOtherIsNamed) {
  Scene scene;
  for (const bool left : {true, false}) {
    ConsistencyMonitor monitor(assumed(), false);
    const Pose<G, B> wrong = turned(0.02);
    const ConsistencyMonitor::Verdict verdict =
        monitor.check(scene.seen(left ? wrong : Pose<G, B>{}, left ? Pose<G, B>{} : wrong), scene.calibration, {}, kStep);
    ASSERT_TRUE(verdict.wrong);
    EXPECT_EQ(verdict.wrong, left ? 0b01 : 0b10);
    EXPECT_FALSE(verdict.imu_contradicts);
    EXPECT_TRUE(monitor.doubt({}).isZero(0)) << "the other camera and the readings agree";
  }
}

TEST(ConsistencyMonitor, OfFourCamerasTheOneThatContradictsIsNamed) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  EXPECT_FALSE(monitor.check(scene.seen_by_four({}, {}), scene.calibration, {}, kStep).wrong);
  const ConsistencyMonitor::Verdict verdict = monitor.check(scene.seen_by_four({}, turned(0.02)), scene.calibration, {}, kStep);
  ASSERT_TRUE(verdict.wrong);
  EXPECT_EQ(verdict.wrong, 0b1000);
  EXPECT_FALSE(verdict.imu_contradicts);
}

TEST(ConsistencyMonitor, APairThatContradictsTheOtherPairIsLeftOut) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  const ConsistencyMonitor::Verdict verdict =
      monitor.check(scene.seen_by_four(turned(0.02), turned(0.02)), scene.calibration, {}, kStep);
  EXPECT_EQ(verdict.wrong, 0b1100);
  EXPECT_FALSE(verdict.imu_contradicts);
}

TEST(ConsistencyMonitor, WhatMovesBeforeOneOfTwoPairsIsNoContradiction) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  for (int k = 0; k < 60; ++k) {
    const ConsistencyMonitor::Verdict verdict =
        monitor.check(scene.seen_by_four(turned(0.0012), turned(0.0012)), scene.calibration, {}, kStep);
    EXPECT_FALSE(verdict.imu_contradicts || verdict.wrong) << k;
  }
  EXPECT_FALSE(monitor.contradicted());
}

TEST(ConsistencyMonitor, ACameraExcludedForDriftAloneIsUsedAgainAfterASecond) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  int excluded = 0, used_again = 0;
  for (int k = 0; k < 100; ++k) {
    // As with landmarks whose depth was estimated while the camera was excluded.
    const auto verdict = monitor.check(scene.seen({}, turned(0.0015)), scene.calibration, {}, kStep);
    const bool wrong = verdict.wrong == 0b10;
    excluded += wrong;
    used_again += !wrong && excluded >= 20;
  }
  EXPECT_GE(excluded, 36);
  EXPECT_GE(used_again, 5) << "long enough for the window to correct its landmarks";
}

TEST(ConsistencyMonitor, ASmallDriftThatLastsIsAContradiction) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  int until = 0;
  // Of 0.014 rad/s: 3.3 standard deviations are added up, less than a contradiction at once needs.
  while (until < 100 && !monitor.check(scene.seen(turned(7e-4)), scene.calibration, {}, kStep).imu_contradicts) ++until;
  EXPECT_GT(until, 10);
  EXPECT_LT(until, 60);
}

TEST(ConsistencyMonitor, WhereNothingExplainsTheImagesThePoseIsNotGood) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  for (int k = 0; k < 10; ++k) {  // half of the points move, and the cameras contradict each other
    (void)monitor.check(scene.seen(turned(0.03), turned(-0.03), 40, turned(0.1)), scene.calibration, {}, kStep);
    EXPECT_TRUE(k <= 3 || monitor.contradicted()) << k;
  }
  EXPECT_FALSE(monitor.follows_images());
  for (int k = 0; k < 20; ++k) (void)monitor.check(scene.seen({}), scene.calibration, {}, kStep);
  EXPECT_FALSE(monitor.contradicted());
}

TEST(ConsistencyMonitor, ALargeMovingThingIsNoContradiction) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  for (int k = 0; k < 20; ++k)  // 35 of 80 points
    EXPECT_FALSE(monitor.check(scene.seen({}, {}, 45, turned(0.03)), scene.calibration, {}, kStep).imu_contradicts);
}

TEST(ConsistencyMonitor, FewLandmarksProveNothing) {
  Scene scene(12);
  ConsistencyMonitor monitor(assumed(), false);
  EXPECT_FALSE(monitor.check(scene.seen(turned(0.05)), scene.calibration, {}, kStep).imu_contradicts);
  EXPECT_FALSE(monitor.contradicted());
}

/// Images that agree, for a second, in `monitor`'s own time.
void calm(ConsistencyMonitor& monitor, Scene& scene, const Vec3& accel_bias = kBias, const Vec3& gyro_bias = Vec3::Zero()) {
  for (int k = 0; k < 20; ++k) {
    (void)monitor.check(scene.seen({}), scene.calibration, {}, kStep);
    scene.now = scene.now + kStep;
    monitor.take({scene.now, {gyro_bias, accel_bias}, 1e-6 * Mat3::Identity(), 1e-4 * Mat3::Identity()});
  }
}

/// Until biases are compared.
void begin(ConsistencyMonitor& monitor, Scene& scene) {
  for (int k = 0; k < 4; ++k) calm(monitor, scene);
}

TEST(ConsistencyMonitor, AContradictionLastsHalfASecondAndLeavesADoubt) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  begin(monitor, scene);
  (void)monitor.check(scene.seen(turned(0.02)), scene.calibration, {}, kStep);
  EXPECT_TRUE(monitor.contradicted());
  EXPECT_TRUE(monitor.contradicts_now());
  int agree = 0;
  for (int k = 0; k < 20 && monitor.contradicted(); ++k) {
    (void)monitor.check(scene.seen({}), scene.calibration, {}, kStep);
    agree += monitor.contradicted() && !monitor.contradicts_now();
  }
  EXPECT_NEAR(agree, 10, 1) << "images of half a second";
  EXPECT_FALSE(monitor.contradicted());
  const Pose<G, B> far{Quat::Identity(), Vec3(10, 0, 0)};
  EXPECT_NEAR(std::sqrt(monitor.doubt(far)(5, 5)), 0.02 * std::sqrt(2), 2e-3) << "heading, of one contradiction";
  EXPECT_NEAR(std::sqrt(monitor.doubt(far)(1, 1)), 0.2 * std::sqrt(2), 0.03) << "and what it means ten metres on";
  EXPECT_FALSE(monitor.take_reset()) << "small enough for the covariance";
}

TEST(ConsistencyMonitor, ALargeDoubtIsToldOnceWhenTheContradictionIsOver) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  begin(monitor, scene);
  for (int k = 0; k < 4; ++k) (void)monitor.check(scene.seen(turned(0.03)), scene.calibration, {}, kStep);
  EXPECT_FALSE(monitor.take_reset()) << "not yet";
  calm(monitor, scene);
  EXPECT_TRUE(monitor.take_reset());
  EXPECT_FALSE(monitor.take_reset());
  EXPECT_TRUE(monitor.doubt({}).isZero(0));
  EXPECT_FALSE(monitor.unrecoverable());
  for (int k = 0; k < 4; ++k) (void)monitor.check(scene.seen(turned(0.03)), scene.calibration, {}, kStep);
  calm(monitor, scene);
  EXPECT_TRUE(monitor.take_reset());
  EXPECT_TRUE(monitor.unrecoverable()) << "two within five seconds";
}

TEST(ConsistencyMonitor, GravityConfirmsOrRefutesATilt) {
  Scene scene;
  for (const bool right : {true, false}) {
    ConsistencyMonitor monitor(assumed(), false);
    begin(monitor, scene);
    for (int k = 0; k < 4; ++k) (void)monitor.check(scene.seen(tilted(0.03)), scene.calibration, {}, kStep);
    calm(monitor, scene);
    EXPECT_TRUE(monitor.contradicted()) << "gravity has not been asked for long enough";
    calm(monitor, scene, right ? kBias : Vec3(kBias + Vec3(0, 0.15, 0)));
    calm(monitor, scene, right ? kBias : Vec3(kBias + Vec3(0, 0.15, 0)));
    EXPECT_EQ(monitor.unrecoverable(), !right);
    EXPECT_EQ(monitor.contradicted(), !right);
  }
}

TEST(ConsistencyMonitor, ABiasThatJumpsIsAFault) {
  for (const bool gyro : {false, true}) {
    Scene scene;
    ConsistencyMonitor monitor(assumed(), false);
    begin(monitor, scene);
    EXPECT_FALSE(monitor.contradicted());
    const Vec3 accel = kBias + Vec3(gyro ? 0 : 0.5, 0, 0), turning(0, 0, gyro ? 0.02 : 0);
    calm(monitor, scene, accel, turning);
    EXPECT_TRUE(monitor.contradicted()) << "no image contradicts it, but no bias moves so far";
    EXPECT_FALSE(monitor.unrecoverable());
    calm(monitor, scene, accel, turning);
    EXPECT_TRUE(monitor.unrecoverable()) << "it stays away";
  }
}

TEST(ConsistencyMonitor, TwoNewWorldsWithinSecondsAreUnrecoverable) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  begin(monitor, scene);
  monitor.count_reset();
  calm(monitor, scene);
  EXPECT_FALSE(monitor.contradicted() || monitor.unrecoverable());
  monitor.count_reset();
  EXPECT_TRUE(monitor.unrecoverable());
}

TEST(ConsistencyMonitor, TurnsOfTheWindowThatTheReadingsExcludeAreAContradiction) {
  Scene scene;
  ConsistencyMonitor monitor(assumed(), false);
  begin(monitor, scene);
  const auto turns = [](double off_rad) { return WindowTurns{Vec3(0, 0, off_rad), 4e-4, 1, Duration::from_seconds(1)}; };
  const auto noise = [&] { return monitor.check(scene.seen({}), scene.calibration, {}, kStep).noise.gyro; };
  monitor.take(turns(0.0035), {}, kStep);
  EXPECT_FALSE(monitor.contradicted()) << "axes may be off by 0.2 percent of the turn";
  monitor.take(turns(0.0045), {}, kStep);
  EXPECT_FALSE(monitor.contradicted()) << "a suspicion";
  EXPECT_NEAR(noise(), 6.25, 0.01) << "so much less do the readings count";
  EXPECT_NEAR(std::sqrt(monitor.doubt({})(0, 0)), 0.1, 1e-9) << "the pose may have moved";
  monitor.take(turns(0.005), {}, kStep);
  EXPECT_TRUE(monitor.contradicted() && monitor.follows_images());
  EXPECT_NEAR(noise(), 7.5, 0.01);
  EXPECT_GT(std::sqrt(monitor.doubt({})(0, 0)), 0.1) << "how far the pose has moved meanwhile";
  monitor.take(turns(0.0035), {}, kStep);
  EXPECT_NEAR(noise(), 7.5, 0.01) << "it has not ended yet";
  monitor.take(turns(0.003), {}, kStep);
  EXPECT_EQ(noise(), 1);
  EXPECT_FALSE(monitor.take_reset()) << "not before half a second without it";
  calm(monitor, scene);
  EXPECT_FALSE(monitor.contradicted());
  EXPECT_TRUE(monitor.take_reset());
  EXPECT_FALSE(monitor.take_reset());
  EXPECT_TRUE(monitor.doubt({}).isZero(0));
}

TEST(ConsistencyMonitor, DoubtedReadingsMayNotCarryAlone) {
  Scene scene, dark(3);
  ConsistencyMonitor monitor(assumed(), false);
  begin(monitor, scene);
  (void)monitor.check(scene.seen(turned(0.05)), scene.calibration, {}, kStep);
  for (int k = 0; k < 10; ++k) (void)monitor.check(dark.seen({}), dark.calibration, {}, kStep);
  EXPECT_TRUE(monitor.unrecoverable());
  ConsistencyMonitor trusted(assumed(), false);
  for (int k = 0; k < 10; ++k) (void)trusted.check(dark.seen({}), dark.calibration, {}, kStep);
  EXPECT_FALSE(trusted.unrecoverable());
}

}  // namespace consistency_monitor_test
}  // namespace fbvins
