// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/camera_groups.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace camera_groups_test {

Camera camera() { return Camera(PinholeRadtan{.fx = 450, .fy = 450, .cx = 376, .cy = 240}, 752, 480); }

/// Two pairs with baselines of 10 cm, the second looking backwards: cameras 0 and 1, 2 and 3.
StereoRig two_pairs() {
  StereoRig rig;
  rig.cameras.assign(2, {camera(), {}});
  rig.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
  const Quat back = so3_exp(Vec3(0, std::numbers::pi, 0));
  rig.cameras.insert(rig.cameras.end(), {{camera(), {back, Vec3(0, 0, -0.1)}}, {camera(), {back, Vec3(-0.1, 0, -0.1)}}});
  return rig;
}

std::vector<std::pair<int, int>> numbers(const StereoRig& rig) {
  std::vector<std::pair<int, int>> out;
  for (const CameraGroup& group : camera_groups(rig)) out.emplace_back(group.first, group.second.value_or(-1));
  return out;
}

using Numbers = std::vector<std::pair<int, int>>;

TEST(CameraGroups, OverlappingCamerasArePairs) {
  StereoRig pair = two_pairs();
  pair.cameras.resize(2);
  EXPECT_EQ(numbers(pair), (Numbers{{0, 1}}));
  EXPECT_EQ(numbers(two_pairs()), (Numbers{{0, 1}, {2, 3}}));
}

TEST(CameraGroups, TheOrderOfTheCamerasDoesNotMatter) {
  StereoRig rig = two_pairs();
  std::swap(rig.cameras[2].T_BC.q, rig.cameras[1].T_BC.q);  // camera 1 looks back, camera 2 does not
  EXPECT_EQ(numbers(rig), (Numbers{{0, 2}, {1, 3}}));
}

TEST(CameraGroups, ACameraWithoutAPartnerIsAlone) {
  StereoRig rig = two_pairs();
  rig.cameras.pop_back();
  EXPECT_EQ(numbers(rig), (Numbers{{0, 1}, {2, -1}}));
  EXPECT_TRUE(has_stereo(rig));
  StereoRig back_to_back = rig;
  back_to_back.cameras[1].T_BC.q = rig.cameras[2].T_BC.q;
  back_to_back.cameras.resize(2);
  EXPECT_EQ(numbers(back_to_back), (Numbers{{0, -1}, {1, -1}}));
  EXPECT_FALSE(has_stereo(back_to_back));
  EXPECT_EQ(numbers(with_one_camera(rig)), (Numbers{{0, -1}}));
}

TEST(CameraGroups, ImagesThatAreTurnedOverlap) {
  StereoRig rig = two_pairs();
  rig.cameras.resize(2);
  rig.cameras[1].T_BC.q = so3_exp(Vec3(0, 0, std::numbers::pi));
  EXPECT_GT(overlap(rig, 0, 1), 0.8);
  EXPECT_EQ(numbers(rig), (Numbers{{0, 1}}));
}

TEST(CameraGroups, NoDepthAtOnePlace) {
  StereoRig rig = two_pairs();
  rig.cameras.resize(2);
  rig.cameras[1].T_BC.p = Vec3(1e-4, 0, 0);
  EXPECT_EQ(overlap(rig, 0, 1), 0);
}

TEST(CameraGroups, OfAPairThatSharesHalfItsViewBothLead) {
  const auto leaders = [](const StereoRig& rig) {
    Numbers out;
    for (const CameraGroup& group : leading_groups(rig)) out.emplace_back(group.first, group.second.value_or(-1));
    return out;
  };
  StereoRig rig = two_pairs();
  EXPECT_EQ(leaders(rig), (Numbers{{0, 1}, {2, 3}}));
  rig.cameras[1].T_BC.q = so3_exp(Vec3(0, 0.6, 0));  // 34 of 80 degrees to the right
  EXPECT_EQ(numbers(rig), (Numbers{{0, 1}, {2, 3}}));
  EXPECT_EQ(leaders(rig), (Numbers{{0, 1}, {2, 3}, {1, 0}}));
}

TEST(CameraGroups, AGroupIsARigOfItsOwn) {
  const StereoRig rig = two_pairs();
  const StereoRig back = rig_of(rig, {2, 3});
  EXPECT_EQ(back.camera_count(), 2);
  EXPECT_TRUE(back.T_BC0().p.isApprox(rig.cameras[2].T_BC.p));
  EXPECT_TRUE(back.T_BC1().p.isApprox(rig.cameras[3].T_BC.p));
  const StereoRig alone = rig_of(rig, {3, std::nullopt});
  EXPECT_FALSE(alone.has_right());
  EXPECT_TRUE(alone.T_BC0().p.isApprox(rig.cameras[3].T_BC.p));
}

}  // namespace camera_groups_test
}  // namespace fbvins
