// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/tilt_check.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/core/angle.hpp"

namespace fbvins {
namespace tilt_check_test {

const Duration kStep = Duration::from_seconds(0.05);
const Vec3 kBias(0.02, -0.01, 0.05);

/// Solves of a flight, 20 a second.
struct Flight {
  TiltCheck check;
  Time now;
  bool refuted = false;

  void fly(double seconds, const Vec3& accel_bias = kBias, const Vec3& gyro_bias = Vec3::Zero(), bool contradicted = false) {
    for (int k = 0; k < static_cast<int>(std::lround(seconds / kStep.seconds())); ++k) {
      now = now + kStep;
      refuted |= check.take({now, {gyro_bias, accel_bias}, 1e-6 * Mat3::Identity(), 1e-4 * Mat3::Identity()}, contradicted);
    }
  }
};

TEST(TiltCheck, ABiasThatComesBackConfirmsTheTilt) {
  Flight flight;
  flight.fly(4);
  EXPECT_FALSE(flight.check.in_doubt());
  flight.fly(1, kBias + Vec3(0.5, 0, 0));
  EXPECT_TRUE(flight.check.in_doubt());
  flight.fly(1);
  EXPECT_TRUE(flight.check.in_doubt()) << "gravity has not been asked for long enough";
  flight.fly(2);
  EXPECT_FALSE(flight.check.in_doubt() || flight.refuted);
}

TEST(TiltCheck, ABiasThatStaysAwayRefutesIt) {
  for (const Vec3& gyro : {Vec3(0, 0, 0), Vec3(0, 0, 0.02)}) {
    Flight flight;
    flight.fly(4);
    const Vec3 accel = gyro.isZero(0) ? Vec3(kBias + Vec3(0.5, 0, 0)) : kBias;
    flight.fly(1, accel, gyro);
    EXPECT_FALSE(flight.refuted);
    flight.fly(1, accel, gyro);
    EXPECT_TRUE(flight.refuted);
  }
}

TEST(TiltCheck, AMoveThatIsUnusualIsSuspectedAndNoDoubt) {
  Flight flight;
  flight.fly(4);
  EXPECT_FALSE(flight.check.suspected());
  flight.fly(0.2, kBias + Vec3(0.12, 0, 0));  // 2.4 standard deviations
  EXPECT_FALSE(flight.check.suspected());
  flight.fly(0.2, kBias + Vec3(0.2, 0, 0));  // 3.9
  EXPECT_TRUE(flight.check.suspected());
  EXPECT_FALSE(flight.check.in_doubt());
  flight.fly(3, kBias + Vec3(0.2, 0, 0));
  EXPECT_FALSE(flight.check.suspected()) << "it does not move any more";
}

TEST(TiltCheck, NothingIsConfirmedDuringAContradiction) {
  Flight flight;
  flight.fly(4);
  flight.check.doubt();
  flight.fly(4, kBias, Vec3::Zero(), true);
  EXPECT_TRUE(flight.check.in_doubt());
  flight.fly(2);
  EXPECT_FALSE(flight.check.in_doubt());
}

TEST(TiltCheck, TurnsAboutTheHorizontalAddUpToATilt) {
  TiltCheck check;
  for (int k = 0; k < 100; ++k) check.add_turn(Vec3(0, 0, kDegree));
  EXPECT_FALSE(check.in_doubt()) << "heading is no tilt";
  for (int k = 0; k < 3; ++k) check.add_turn(Vec3(0.4 * kDegree, 0, 0));
  EXPECT_TRUE(check.in_doubt());
}

TEST(TiltCheck, ABiasThatWasRefutedIsNotBelievedAfterTheRestart) {
  Flight flight;
  const Vec3 turning(0, 0, 0.02);
  flight.fly(8);
  flight.fly(4, kBias, turning);
  ASSERT_TRUE(flight.refuted);
  flight.check.restart();
  flight.fly(1, kBias, turning);
  EXPECT_TRUE(flight.check.in_doubt());
  flight.check.restart();
  flight.now = flight.now + Duration::from_seconds(31);
  flight.fly(4, kBias, turning);
  EXPECT_FALSE(flight.check.in_doubt()) << "half a minute later it may be another one";
}

TEST(TiltCheck, ABiasOfABadStartIsNotHeldAgainstTheNext) {
  Flight flight;
  const Vec3 turning(0, 0, 0.02);
  flight.fly(4);
  flight.fly(4, kBias, turning);
  ASSERT_TRUE(flight.refuted);
  flight.check.restart();
  flight.fly(4, kBias, turning);
  EXPECT_FALSE(flight.check.in_doubt());
}

TEST(TiltCheck, ABiasThatIsStillBeingFoundMoves) {
  TiltCheck check;
  for (int k = 0; k < 80; ++k) {
    const Mat3 found = std::pow(0.3 - 0.003 * k, 2) * Mat3::Identity();
    check.take({Time{k * kStep.ns}, {Vec3::Zero(), Vec3(0.01 * k, 0, 0)}, 1e-6 * Mat3::Identity(), found}, false);
  }
  EXPECT_FALSE(check.in_doubt());
}

}  // namespace tilt_check_test
}  // namespace fbvins
