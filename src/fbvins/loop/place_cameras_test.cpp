// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_cameras.hpp"

#include <gtest/gtest.h>

#include "tests/support/noise_texture.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace place_cameras_test {

using Poses = std::vector<Pose<B, C0>>;

/// Keyframes of cameras before a texture; those of `missing` deliver nothing.
Keyframe keyframe(const StereoRig& rig, const std::vector<int>& missing = {}) {
  static const NoiseTexture texture(5, 20);
  static const auto image = std::make_shared<const Image>(render_texture(
      752, 480, texture, [](const Vec2& px) { return px; }, 128, 40));
  const auto of = [&](int camera) { return std::ranges::count(missing, camera) > 0 ? nullptr : image; };
  Keyframe k = test_room::keyframe(FrameId{1}, Time{}, {});
  k.images.images.clear();
  for (int camera = 0; camera < rig.camera_count(); ++camera) k.images.images.push_back(of(camera));
  return k;
}

PlaceCameras cameras_of(const StereoRig& rig) {
  return PlaceCameras(rig, {.max_features = 50}, test_room::vocabulary(), make_identity_stage());
}

/// Of the cameras that see the places of so many keyframes.
Poses turns(PlaceCameras& cameras, const Keyframe& k, int keyframes) {
  Poses poses;
  for (int i = 0; i < keyframes; ++i) {
    const std::optional<std::size_t> camera = cameras.next(k.images);
    EXPECT_GT(cameras.extract(camera.value(), k).size(), 20u);
    poses.push_back(cameras.T_BC(*camera));
  }
  return poses;
}

void expect_turns(const StereoRig& rig, const std::vector<int>& expected, const std::vector<int>& missing = {}) {
  PlaceCameras cameras = cameras_of(rig);
  const Poses poses = turns(cameras, keyframe(rig, missing), static_cast<int>(expected.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) EXPECT_EQ(poses[i].p, rig.T_BC(expected[i]).p) << i;
}

TEST(PlaceCameras, PairsTakeTurnsEachWithItsFirstCamera) { expect_turns(test_room::rig_that_looks_back(), {0, 2, 0, 2}); }

TEST(PlaceCameras, APairSeesEachPlaceWithItsLeftCameraOrWhereThatDeliversNothingWithTheRightOne) {
  expect_turns(test_room::rig(), {0, 0});
  expect_turns(test_room::rig(), {1, 1}, {0});
  expect_turns(test_room::rig_that_looks_back(), {2, 1, 2, 1}, {0});
  expect_turns(test_room::rig_that_looks_back(), {3, 3}, {0, 1, 2});
}

TEST(PlaceCameras, WithoutAnyPairEachCameraHasItsTurnBesideAPairNoOtherHas) {
  const StereoRig quad = test_room::rig_that_looks_back();
  const StereoRig apart = with_cameras(quad, {quad.mounted(0), quad.mounted(2)});
  expect_turns(apart, {0, 1, 0});
  expect_turns(with_cameras(quad, {quad.mounted(0), quad.mounted(2), quad.mounted(1)}), {0, 0});
}

TEST(PlaceCameras, NoneWhereNoneDelivers) {
  const StereoRig rig = test_room::rig();
  EXPECT_FALSE(cameras_of(rig).next(keyframe(rig, {0, 1}).images));
}

}  // namespace place_cameras_test
}  // namespace fbvins
