// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/alignment_rotation.hpp"

#include <gtest/gtest.h>

#include "tests/support/imu_test_motion.hpp"

namespace fbvins {
namespace alignment_rotation_test {

using test::Motion;
const ImuBias kBias{Vec3(0.02, -0.03, 0.08), Vec3(0.05, -0.06, 0.04)};
const Quat kR_VW = so3_exp(Vec3(1.0, -0.7, 0.4));  // the visual world's arbitrary orientation

struct Window {
  std::vector<Pose<VisualWorld, B>> poses;
  std::vector<Preintegration> between;  ///< at bias zero

  Window(const Motion& motion, int frames, double noise_rad) {
    Rng rng(7);
    for (int k = 0; k < frames; ++k) {
      const Time t = Time{1'000'000'000 + k * 50'000'000};
      poses.push_back(
          {(kR_VW * motion.state(t.seconds()).T_FB.q * so3_exp(noise_rad * test::normal3(rng))).normalized(), Vec3::Zero()});
      if (k == 0) continue;
      between.emplace_back(ImuNoise{}, ImuBias{});
      between.back().integrate(motion.segment(Time{t.ns - 50'000'000}, t, Duration{5'000'000}, kBias));
    }
  }
};

TEST(AlignRotations, FindsTheGyroBias) {
  Window w(Motion(0.5, 0.4), 10, 0);
  const RotationAlignment r = align_rotations(w.poses, w.between, {});
  ASSERT_TRUE(r.solved);
  EXPECT_LT((r.gyro_bias_radps - kBias.gyro_radps).norm(), 1e-3);
  EXPECT_LT((w.between[0].linearisation_bias().gyro_radps - r.gyro_bias_radps).norm(), 1e-12) << "repropagated there";
  EXPECT_LT(r.rms, 0.1);
}

TEST(AlignRotations, SmoothsVisualOrientationsWithTheGyro) {
  const Motion motion(0.5, 0.4);
  const double noise_rad = 2e-3;
  Window w(motion, 12, noise_rad);
  const RotationAlignment r = align_rotations(w.poses, w.between, {});
  ASSERT_TRUE(r.solved);
  double before = 0, after = 0;
  const auto error = [](const Quat& a, const Quat& b) { return so3_log(a.conjugate() * b).squaredNorm(); };
  for (std::size_t k = 0; k < w.poses.size(); ++k) {
    const Quat truth = kR_VW * motion.state(1.0 + 0.05 * static_cast<double>(k)).T_FB.q;
    before += error(truth, w.poses[k].q);
    after += error(truth, r.R_VB[k]);
  }
  EXPECT_LT(after, 0.5 * before);
  EXPECT_NEAR(r.rms, 1, 0.6) << "in sigmas";
}

TEST(AlignRotations, SaysWhenOrientationsAndGyroDisagree) {
  Window w(Motion(0.5, 0.4), 10, 0.05);
  EXPECT_GT(align_rotations(w.poses, w.between, {}).rms, 4);
}

}  // namespace alignment_rotation_test
}  // namespace fbvins
