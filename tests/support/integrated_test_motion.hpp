// SPDX-License-Identifier: Apache-2.0
// For tests: half a second of the motion with known biases, and its readings integrated.
#pragma once

#include "fbvins/imu/preintegration.hpp"
#include "tests/support/imu_test_motion.hpp"

namespace fbvins::test {

inline constexpr Time kFrom{1'000'000'000}, kTo{1'500'000'000};
inline const ImuBias kBias{Vec3(0.02, -0.03, 0.05), Vec3(0.1, -0.2, 0.15)};

inline Preintegration integrated(const ImuSegment& segment, const ImuBias& bias, const ImuNoise& noise = {}) {
  Preintegration p(noise, bias);
  p.integrate(segment);
  return p;
}

}  // namespace fbvins::test
