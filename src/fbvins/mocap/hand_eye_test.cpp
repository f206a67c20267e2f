// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/hand_eye.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "fbvins/core/angle.hpp"
#include "fbvins/core/rng.hpp"
#include "tests/support/hand_eye_scene.hpp"

namespace fbvins {
namespace hand_eye_test {

constexpr Time kStart{1'700'000'000'123'456'789};
Result<HandEye> align_clean(const MarkerTrack& track, const Trajectory<W>& estimate, const HandEyeOptions& options = {}) {
  return align_hand_eye(inspect(track).kept(track), estimate, options);
}

TEST(HandEye, WithoutNoiseItIsExact) {
  const test::ExactFlight flight(3, 40);
  const test::OdometryErrors none{0, 0, 0, 5, 0, 1e-6, 1e-6};
  const test::MarkerRecording recording = test::record(flight, kStart, {1e-6, 1e-6, 0, 0, false, false}, 3);
  const auto found = align_clean(recording.track, test::estimate_of(flight, kStart, none, 3));
  ASSERT_TRUE(found.ok()) << found.error().message;
  const Eigen::Matrix<double, 7, 1> e = test::error_of(found->calibration, recording.truth);
  EXPECT_LT(e.head<3>().norm(), 2e-4);
  EXPECT_LT(e.segment<3>(3).norm(), 2e-4);
  EXPECT_LT(std::abs(e(6)), 2e-5);
  EXPECT_NEAR(found->scale, 1, 1e-4);
  const Trajectory<W> truth = body_truth(found->kept, found->calibration);
  for (std::size_t i = 0; i < truth.size(); i += 50) {
    const double t = (truth[i].t - kStart).seconds();
    if (t > 0 && t < 40) {
      EXPECT_LT((truth[i].T.p - flight.at(t).p).norm(), 1e-3);
    }
  }
}

TEST(HandEye, FindsAClockThatDrifts) {
  const test::ExactFlight flight(4, 60);
  const test::MarkerRecording recording = test::record(flight, kStart, {}, 4, 60e-6);
  const auto found = align_clean(recording.track, test::estimate_of(flight, kStart, {}, 4), {.clock_drift = true});
  ASSERT_TRUE(found.ok()) << found.error().message;
  const double sigma = std::sqrt(found->covariance(13, 13));
  EXPECT_LT(sigma, 2e-5);
  EXPECT_NEAR(found->calibration.drift, 60e-6, 4 * sigma);
  EXPECT_LT(std::abs(test::error_of(found->calibration, recording.truth)(6)), 0.5e-3);
}

TEST(HandEye, ALevelWorldHasOnlyAHeading) {
  const test::ExactFlight flight(5, 60);
  const test::MarkerRecording recording = test::record(flight, kStart, {}, 5, 0, true);
  const auto found = align_clean(recording.track, test::estimate_of(flight, kStart, {}, 5), {.level_world = true});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_NEAR(std::abs((found->calibration.T_VW.q * Vec3::UnitZ()).z()), 1, 1e-12);
  EXPECT_LT(so3_log(found->calibration.T_VW.q.conjugate() * recording.truth.T_VW.q).norm() * kDegreesPerRad, 0.3);
  EXPECT_EQ(found->covariance(9, 9), 0);
}

TEST(HandEye, TheSameInputGivesTheSameBits) {
  const test::ExactFlight flight(6, 30);
  const test::MarkerRecording recording = test::record(flight, kStart, {}, 6);
  const Trajectory<W> estimate = test::estimate_of(flight, kStart, {}, 6);
  const auto once = align_clean(recording.track, estimate), again = align_clean(recording.track, estimate);
  ASSERT_TRUE(once.ok() && again.ok()) << once.error().message;
  EXPECT_EQ(once->calibration.T_BK.p, again->calibration.T_BK.p);
  EXPECT_EQ(once->covariance, again->covariance);
}

// ------------------------------------------------------------------------------------------------ refused, in one sentence

std::string refusal(const MarkerTrack& track, const Trajectory<W>& estimate) {
  const auto found = align_clean(track, estimate);
  return found.ok() ? "found" : found.error().message;
}

TEST(HandEye, RefusesAFlightThatDoesNotTilt) {
  test::ExactFlight flight(7, 60, false);
  flight.size = 0.02;  // a hover that turns
  const test::MarkerRecording recording = test::record(flight, kStart, {}, 7);
  const std::string said = refusal(recording.track, test::estimate_of(flight, kStart, {}, 7));
  EXPECT_NE(said.find("the motion does not show how the markers are turned about"), std::string::npos) << said;
}

TEST(HandEye, RefusesARest) {
  test::ExactFlight flight(8, 60, false);
  flight.size = 0;
  flight.still_yaw = true;
  const test::MarkerRecording recording = test::record(flight, kStart, {}, 8);
  const std::string said = refusal(recording.track, test::estimate_of(flight, kStart, {}, 8));
  EXPECT_NE(said.find("at no offset of the clocks"), std::string::npos) << said;
}

TEST(HandEye, RefusesMirroredAxes) {
  const test::ExactFlight flight(9, 60);
  MarkerTrack track = test::record(flight, kStart, {}, 9).track;
  for (MarkerPose& pose : track)
    pose.T_VK = {Quat(pose.T_VK.q.w(), -pose.T_VK.q.x(), -pose.T_VK.q.y(), -pose.T_VK.q.z()), Vec3(-pose.T_VK.p)};
  const std::string said = refusal(track, test::estimate_of(flight, kStart, {}, 9));
  EXPECT_NE(said.find("are the axes mirrored, or is the body flipped"), std::string::npos) << said;
}

TEST(HandEye, ABodyThatIsFlippedForHalfOfTheFlightIsSaidAndTheOtherHalfUsed) {
  const test::ExactFlight flight(10, 60);
  const test::MarkerRecording recording = test::record(flight, kStart, {.gaps = 0, .jump = false, .flip_behind_gap = false}, 10);
  MarkerTrack track = recording.track;
  const std::size_t n = track.size();
  track.erase(track.begin() + static_cast<std::ptrdiff_t>(n / 2), track.begin() + static_cast<std::ptrdiff_t>(n / 2 + 80));
  for (std::size_t i = n / 2; i < track.size(); ++i) track[i].T_VK.q = track[i].T_VK.q * so3_exp(Vec3(0, 3.1, 0));
  const auto found = align_clean(track, test::estimate_of(flight, kStart, {}, 10));
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_EQ(found->faults.size(), 1u);
  EXPECT_EQ(found->faults[0].kind, MarkerFaultKind::flip);
  EXPECT_NEAR(found->faults[0].angle_rad, 3.1, 0.05);
  EXPECT_NEAR((found->faults[0].from - track[n / 2 - 1].t).seconds(), 0, 0.2);
  EXPECT_NEAR((found->faults[0].to - found->calibration.to_marker(kStart)).seconds(), 60, 0.2);
  EXPECT_LT(test::error_of(found->calibration, recording.truth).head<3>().norm(), 5e-3);
}

// ------------------------------------------------------------------------------------------------ poses that do not fit

/// A share of the poses is off: in height, level position, tilt or heading.
TEST(HandEye, PosesThatDoNotFitAreLeftOutFewOrMany) {
  const test::ExactFlight flight(11, 60);
  const test::MarkerRecording recording = test::record(flight, kStart, {}, 11);
  const Trajectory<W> good = test::estimate_of(flight, kStart, {}, 11);
  for (const double share : {0.0, 0.02, 0.09}) {
    Trajectory<W> estimate = good;
    Rng rng(5);
    for (StampedPose<W>& pose : estimate) {
      if (rng.uniform() >= share) continue;
      const std::uint32_t kind = rng.below(4);
      if (kind < 2) pose.T.p += 0.15 * (kind == 0 ? Vec3::UnitZ() : Vec3::UnitX());
      else pose.T.q = pose.T.q * so3_exp(0.1 * (kind == 2 ? Vec3::UnitX() : Vec3::UnitZ()));
    }
    const auto found = align_clean(recording.track, estimate);
    ASSERT_TRUE(found.ok()) << share << ": " << found.error().message;
    EXPECT_NEAR(found->outliers, share * (found->pairs + found->outliers), 0.015 * found->pairs) << share;
    const Eigen::Matrix<double, 7, 1> e = test::error_of(found->calibration, recording.truth);
    EXPECT_LT(e.head<3>().norm(), 3e-3) << share;
    EXPECT_LT(e.segment<3>(3).norm() * kDegreesPerRad, 0.05) << share;
  }
}

}  // namespace hand_eye_test
}  // namespace fbvins
