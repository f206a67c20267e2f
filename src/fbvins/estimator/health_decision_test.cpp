// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/health_decision.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

namespace fbvins {
namespace health_decision_test {

struct Cause {
  std::function<void(HealthEvidence&)> happens;
  Health health;
};

Health lost(HealthReason reason) { return {HealthState::lost, reason}; }
Health degraded(HealthReason reason, std::uint8_t cameras = 0) { return {HealthState::degraded, reason, cameras}; }

/// In order of precedence.
const std::vector<Cause> kCauses = {
    {[](HealthEvidence& e) { e.start_refused = true; }, {HealthState::initialising, HealthReason::alignment_refused}},
    {[](HealthEvidence& e) { e.waiting_for = HealthReason::too_few_features; },
     {HealthState::initialising, HealthReason::too_few_features}},
    {[](HealthEvidence& e) { e.finite = false; }, lost(HealthReason::solver_failed)},
    {[](HealthEvidence& e) { e.speed_mps = 31; }, lost(HealthReason::implausible_speed)},
    {[](HealthEvidence& e) { e.accel_bias_mps2 = 3; }, lost(HealthReason::implausible_bias)},
    {[](HealthEvidence& e) { e.unrecoverable = true; }, lost(HealthReason::contradiction)},
    {[](HealthEvidence& e) { e.failed_solves = 1; }, degraded(HealthReason::solver_failed)},
    {[](HealthEvidence& e) { e.after_gap = true; }, degraded(HealthReason::imu_gap)},
    {[](HealthEvidence& e) { e.images_missing = true; }, degraded(HealthReason::no_images)},
    {[](HealthEvidence& e) { e.broken_features = 1; }, degraded(HealthReason::frontend_fault)},
    {[](HealthEvidence& e) { e.landmarks_in_view = 0; }, degraded(HealthReason::no_tracks)},
    {[](HealthEvidence& e) { e.after_dark = true; }, degraded(HealthReason::few_tracks)},
    {[](HealthEvidence& e) { e.no_pair_sees = true; }, degraded(HealthReason::one_camera)},
    {[](HealthEvidence& e) { e.wrong_cameras = 2; }, degraded(HealthReason::cameras_disagree, 2)},
    {[](HealthEvidence& e) { e.clipped = true; }, degraded(HealthReason::imu_clipped)},
    {[](HealthEvidence& e) { e.contradiction = true; }, degraded(HealthReason::contradiction)},
    {[](HealthEvidence& e) { e.gyro_vibration_radps = 0.4; }, degraded(HealthReason::imu_vibration)},
    {[](HealthEvidence& e) { e.correction = HealthEvidence::Correction::pending; }, degraded(HealthReason::correction_pending)},
    {[](HealthEvidence& e) { e.doubted_sensor = HealthReason::range_disagrees; }, degraded(HealthReason::range_disagrees)},
};

TEST(HealthDecision, WithNothingAgainstItAFrameIsGood) {
  EXPECT_EQ(decide_health({}), (Health{HealthState::good, HealthReason::none}));
}

TEST(HealthDecision, OfTwoCausesTheOneThatIsWrittenFirstDecides) {
  for (std::size_t i = 0; i < kCauses.size(); ++i) {
    HealthEvidence alone;
    kCauses[i].happens(alone);
    EXPECT_EQ(decide_health(alone), kCauses[i].health) << i;
    for (std::size_t j = i + 1; j < kCauses.size(); ++j) {
      HealthEvidence both = alone;
      kCauses[j].happens(both);
      EXPECT_EQ(decide_health(both), kCauses[i].health) << i << " and " << j;
    }
  }
}

TEST(HealthDecision, ACameraThatDeliversNothingIsNamedBeforeAndAfterTheStart) {
  EXPECT_EQ(decide_health({.missing_cameras = 2}), degraded(HealthReason::one_camera, 2));
  EXPECT_EQ(decide_health({.waiting_for = HealthReason::too_few_features, .missing_cameras = 2}),
            (Health{HealthState::initialising, HealthReason::one_camera, 2}));
  EXPECT_EQ(decide_health({.waiting_for = HealthReason::too_few_features, .without_images = true, .missing_cameras = 3}),
            (Health{HealthState::initialising, HealthReason::no_images}));
}

TEST(HealthDecision, WithoutTracksAPoseIsLostOnceItHasGrownTooUncertain) {
  EXPECT_EQ(decide_health({.few_tracks = true, .blind_m = 0.4}), degraded(HealthReason::few_tracks));
  EXPECT_EQ(decide_health({.few_tracks = true, .blind_m = 0.6}), lost(HealthReason::no_tracks));
  EXPECT_EQ(decide_health({.images_missing = true, .few_tracks = true, .blind_m = 0.6}), lost(HealthReason::no_images));
  EXPECT_EQ(decide_health({.few_tracks = true, .blind_m = 0.6}, {.blind_m = 1}), degraded(HealthReason::few_tracks));
  EXPECT_EQ(decide_health({.few_tracks = true, .longest_gap_s = 2}), lost(HealthReason::imu_gap));
  EXPECT_EQ(decide_health({.longest_gap_s = 2}), degraded(HealthReason::imu_gap)) << "the images carry on";
}

}  // namespace health_decision_test
}  // namespace fbvins
