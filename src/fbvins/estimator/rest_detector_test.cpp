// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/rest_detector.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace rest_detector_test {

/// Frame k at 20 Hz: thirty features moved by `drift_px` a frame, quiet readings.
TrackedFrame frame(int k, double drift_px = 0, double shake_radps = 0) {
  TrackedFrame f;
  f.t = Time{k * 50'000'000};
  for (int i = 0; i < 30; ++i) {
    TrackedFeature feature;
    feature.id = TrackId{i};
    feature.see(0, Observation{.pixel = Vec2(20 * i + drift_px * k, 100)});
    f.features.push_back(feature);
  }
  for (int i = 0; i <= 10; ++i)
    f.imu.samples.push_back({f.t + Duration{(i - 10) * 5'000'000}, Vec3(i % 2 ? shake_radps : 0, 0, 0), Vec3(0, 0, 9.81)});
  return f;
}

TEST(RestDetector, SaysHowLongTheBodyHasRested) {
  RestDetector rest;
  EXPECT_EQ(rest.update(frame(0)), Duration{}) << "one image says nothing";
  for (int k = 1; k < 20; ++k) EXPECT_EQ(rest.update(frame(k)), frame(k).t - frame(0).t);
}

TEST(RestDetector, ASlowDriftEndsIt) {
  RestDetector rest;
  Duration longest{};
  for (int k = 0; k < 40; ++k) longest = std::max(longest, rest.update(frame(k, 0.1)));  // a tenth of a pixel a frame
  EXPECT_LE(longest, Duration{6 * 50'000'000}) << "0.6 px since the rest began are too much";
}

TEST(RestDetector, AShakingOrSilentImuIsNoRest) {
  RestDetector rest;
  for (int k = 0; k < 10; ++k) EXPECT_EQ(rest.update(frame(k, 0, 0.2)), Duration{});
  for (int k = 10; k < 20; ++k) {
    TrackedFrame silent = frame(k);
    silent.imu = {};
    EXPECT_EQ(rest.update(silent), Duration{});
  }
}

TEST(RestDetector, TooFewFeaturesAreNoRest) {
  RestDetector rest;
  for (int k = 0; k < 10; ++k) {
    TrackedFrame poor = frame(k);
    poor.features.resize(5);
    EXPECT_EQ(rest.update(poor), Duration{});
  }
}

TEST(RestDetector, BeginsAnewAfterAReset) {
  RestDetector rest;
  for (int k = 0; k < 10; ++k) rest.update(frame(k));
  rest.reset();
  EXPECT_EQ(rest.update(frame(10)), Duration{});
  EXPECT_EQ(rest.update(frame(11)), Duration{50'000'000});
}

}  // namespace rest_detector_test
}  // namespace fbvins
