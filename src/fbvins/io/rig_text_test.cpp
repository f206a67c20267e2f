// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/rig_text.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace rig_text_test {

/// Numbers whose last bits matter.
StereoRig awkward_rig(Rng& rng, bool fisheye) {
  const auto odd = [&] { return rng.normal() / 3.0; };
  StereoRig rig;
  rig.cameras.resize(2);
  const double f = 400.0 + odd(), c = 310.0 + odd(), k1 = 0.03 * std::abs(odd()), k2 = 1e-7 * odd(), k3 = 1e-3 * odd(),
               k4 = 1e-3 * odd();
  if (fisheye) rig.cameras[0].camera = Camera(KannalaBrandt{f, f / 3, c, c / 4, k1, k2, k3, k4}, 640, 161);
  else rig.cameras[0].camera = Camera(PinholeRadtan{f, f / 3, c, c / 4, k1, k2, k3, k4}, 640, 161);
  rig.cameras[1].camera = Camera(PinholeRadtan{f / 1.1, f / 1.3, c * 1.1, c / 1.3, k2, k1, k4, k3}, 752, 480);
  const double x = odd(), y = odd(), z = odd();
  rig.cameras[0].T_BC = {so3_exp(Vec3(x, y, z)), Vec3(z, x, y)};
  rig.cameras[1].T_BC = {so3_exp(Vec3(y, z, x)), Vec3(z + 0.1, x, y)};
  rig.imu_noise = {1e-4 / 3, 2e-3 / 7, 2e-5 / 3, 3e-3 / 11, 200.0 / 3};
  rig.image_rate_hz = 20.0 / 3;
  rig.time_offset_s = odd() / 100;
  rig.line_delay_s = odd() / 1e5;
  rig.cameras[1].camera.set_own_times({0.01 / 3, 1e-5 / 7});
  return rig;
}

template <class Model>
bool same(const Model& a, const Model& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

bool same_camera(const Camera& a, const Camera& b) {
  if (a.width() != b.width() || a.height() != b.height() || a.model().index() != b.model().index() ||
      a.own_times() != b.own_times())
    return false;
  return std::visit([&](const auto& m) { return same(m, std::get<std::decay_t<decltype(m)>>(b.model())); }, a.model());
}

TEST(RigText, GivesBackTheSameBits) {
  Rng rng(11);
  for (int i = 0; i < 100; ++i) {
    const StereoRig rig = awkward_rig(rng, i % 2 == 0);
    const auto back = parse_rig(rig_to_yaml(rig), "calibration.yaml");
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_TRUE(same_camera(back->left(), rig.left()));
    EXPECT_TRUE(same_camera(back->right(), rig.right()));
    EXPECT_TRUE(back->T_BC0().q.coeffs() == rig.T_BC0().q.coeffs() && back->T_BC0().p == rig.T_BC0().p);
    EXPECT_TRUE(back->T_BC1().q.coeffs() == rig.T_BC1().q.coeffs() && back->T_BC1().p == rig.T_BC1().p);
    EXPECT_TRUE(same(back->imu_noise, rig.imu_noise));
    EXPECT_EQ(back->image_rate_hz, rig.image_rate_hz);
    EXPECT_EQ(back->time_offset_s, rig.time_offset_s);
    EXPECT_EQ(back->line_delay_s, rig.line_delay_s);
    EXPECT_EQ(back->left().max_normalised_radius(), rig.left().max_normalised_radius());
  }
}

TEST(RigText, GivesBackARigOfOneCamera) {
  Rng rng(13);
  const StereoRig rig = with_one_camera(awkward_rig(rng, true));
  const auto back = parse_rig(rig_to_yaml(rig), "calibration.yaml");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_FALSE(back->has_right());
  EXPECT_TRUE(same_camera(back->left(), rig.left()));
  EXPECT_EQ(back->T_BC1().p, rig.T_BC0().p);
}

TEST(RigText, GivesBackFourCameras) {
  Rng rng(15);
  StereoRig rig = awkward_rig(rng, true);
  const StereoRig others = awkward_rig(rng, false);
  rig.cameras.insert(rig.cameras.end(), {others.mounted(0), others.mounted(1)});
  const auto back = parse_rig(rig_to_yaml(rig), "calibration.yaml");
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->camera_count(), 4);
  for (int i = 2; i < 4; ++i) {
    EXPECT_TRUE(same_camera(back->camera(i), rig.camera(i)));
    EXPECT_TRUE(back->T_BC(i).q.coeffs() == rig.T_BC(i).q.coeffs() && back->T_BC(i).p == rig.T_BC(i).p);
  }
}

TEST(RigText, GivesBackADepthSensor) {
  Rng rng(14);
  DepthSensor sensor{.noise_at_1m_m = 0.01 / 3, .nearest_m = 0.1 / 7, .farthest_m = 20.0 / 3, .scale_sigma = 0.1 / 11};
  for (const bool elsewhere : {false, true}) {
    StereoRig rig = awkward_rig(rng, false);
    if (elsewhere) sensor.own = MountedCamera{rig.right(), {rig.T_BC1().q, rig.T_BC0().p + Vec3(0.1 / 3, 0.1 / 7, 0)}};
    rig = with_depth(rig, sensor);
    const auto back = parse_rig(rig_to_yaml(rig), "calibration.yaml");
    ASSERT_TRUE(back) << back.error().message;
    ASSERT_TRUE(back->depth);
    EXPECT_EQ(back->depth->noise_at_1m_m, sensor.noise_at_1m_m);
    EXPECT_EQ(back->depth->nearest_m, sensor.nearest_m);
    EXPECT_EQ(back->depth->farthest_m, sensor.farthest_m);
    EXPECT_EQ(back->depth->scale_sigma, sensor.scale_sigma);
    EXPECT_EQ(back->T_BC1().p, rig.T_BC1().p);
    ASSERT_EQ(back->depth->own.has_value(), elsewhere);
    if (!elsewhere) continue;
    EXPECT_TRUE(same_camera(back->depth->own->camera, sensor.own->camera));
    EXPECT_TRUE(back->depth->own->T_BC.q.coeffs() == sensor.own->T_BC.q.coeffs() &&
                back->depth->own->T_BC.p == sensor.own->T_BC.p);
  }
}

TEST(RigText, GivesBackTheBitsOfWideLenses) {
  Rng rng(12);
  StereoRig rig = awkward_rig(rng, true);
  for (const auto& [left, right] :
       {std::pair<LensModel, LensModel>{DoubleSphere{300.1 / 3, 301, 150, 251 / 2.1, -0.1 / 3, 0.59 / 3},
                                        ExtendedUnified{300, 301 / 3.0, 160.2 / 1.1, 124, 0.1 / 3, 1.04 / 3}},
        {UnifiedRadtan{300.1 / 3, 301, 150, 251 / 2.1, 0.8 / 3, -0.3 / 7, 0.1 / 7, 1e-3 / 7, -1e-4 / 7},
         DoubleSphere{300, 301, 150, 121, 0.3, 0.5}}}) {
    rig.cameras[0].camera = Camera(left, 320, 240), rig.cameras[1].camera = Camera(right, 320, 240);
    const auto back = parse_rig(rig_to_yaml(rig), "calibration.yaml");
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_TRUE(same_camera(back->left(), rig.left()));
    EXPECT_TRUE(same_camera(back->right(), rig.right()));
  }
}

TEST(RigText, ComplainsWithTheField) {
  Rng rng(3);
  const std::string good = rig_to_yaml(awkward_rig(rng, false));
  for (const auto& [from, to, sentence] :
       {std::tuple{"T_BC1:\n  q_wxyz: [", "T_BC1:\n  q_wxyz: [2", "c.yaml:21: q_wxyz: is not a rotation"},
        {"\ntime_offset_s", "\ntime_offset", "c.yaml: time_offset_s: is missing"},
        {"  rate_hz: ", "  rate_hz: -", "c.yaml:24: rate_hz: "}}) {
    std::string text = good;
    text.replace(text.find(from), std::string(from).size(), to);
    const auto rig = parse_rig(text, "c.yaml");
    ASSERT_FALSE(rig) << from;
    EXPECT_TRUE(rig.error().message.starts_with(sentence)) << rig.error().message;
  }
}

}  // namespace rig_text_test
}  // namespace fbvins
