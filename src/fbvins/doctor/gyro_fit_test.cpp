// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/gyro_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "tests/support/synthetic_evidence.hpp"

namespace fbvins {
namespace gyro_fit_test {

std::optional<GyroFit> fit(const Evidence& evidence, const StereoRig& rig, double offset_s) {
  return fit_gyro(evidence.frames, ImuSeries(evidence.imu), rig, offset_s);
}

TEST(GyroFit, FindsOffsetLineDelayAndMountingTogether) {
  const Evidence evidence = test::SyntheticEvidence({.late_s = 0.03, .rolling_s = 0.02}).make();
  StereoRig rig = evidence.rig;
  const Vec3 turned(0.05, -0.03, 0.04);
  rig.cameras[0].T_BC = {Mat3(so3_exp(turned).toRotationMatrix() * rig.T_BC0().R()), rig.T_BC0().p};
  const auto found = fit(evidence, rig, 0.01);  // as far as rotations say
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->offset_s, 0.03, 0.001);
  EXPECT_LT(std::abs(found->offset_s - 0.03), 4 * found->offset_sigma_s);
  EXPECT_NEAR(found->line_delay_s, 0.02 / 480, 3e-6);
  EXPECT_LT(so3_log(Quat(Mat3(found->R_CB * evidence.rig.T_BC0().R()))).norm(), 0.01);
}

TEST(GyroFit, AGapCostsThePairsAroundIt) {
  Evidence evidence = test::SyntheticEvidence({.late_s = 0.03}).make();
  std::erase_if(evidence.imu, [](const ImuSample& s) { return s.t.seconds() > 7 && s.t.seconds() < 7.2; });
  const auto found = fit(evidence, evidence.rig, 0);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->offset_s, 0.03, 0.001);
}

TEST(GyroFit, FewImagesSayNothing) {
  Evidence evidence = test::SyntheticEvidence({.seconds = 2}).make();
  EXPECT_FALSE(fit(evidence, evidence.rig, 0));
}

}  // namespace gyro_fit_test
}  // namespace fbvins
