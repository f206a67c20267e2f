// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/loop_map.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/vocabulary_file.hpp"
#include "tests/support/noise_texture.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace loop_map_test {

namespace fs = std::filesystem;

class OpenedMap : public testing::Test {
 protected:
  fs::path folder_ = fs::temp_directory_path() / ("fbvins_loop_map_test_" + std::to_string(::getpid()));
  std::string path_ = (folder_ / "m.fbm").string();
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
};

/// A keyframe before a textured wall, `x_m` along it.
Keyframe before_a_wall(int number, double x_m) {
  static const NoiseTexture texture(3);
  const auto image = [&](double shift_px) {
    return std::make_shared<Image>(render_texture(
        752, 480, texture, [&](const Vec2& p) { return Vec2(p + Vec2(shift_px, 0)); }, 128, 40));
  };
  constexpr double kDepth_m = 3;
  const double shift_px = -x_m * test_room::kFocal / kDepth_m;  // the body's y points left
  Keyframe k;
  k.id = FrameId{number};
  k.t = Time{} + Duration::from_seconds(number);
  k.gauge.T_GB.p.y() = x_m;
  k.images = {k.t, {image(shift_px), image(shift_px + test_room::kFocal * test_room::kBaseline / kDepth_m)}};
  return k;
}

TEST_F(OpenedMap, IsSavedOpenedAndFoundAgain) {
  auto map = LoopMap::create(test_room::rig());
  ASSERT_TRUE(map.ok()) << map.error().message;
  std::vector<Keyframe> flown;
  for (int i = 0; i < 4; ++i) {
    flown.push_back(before_a_wall(i, 0.15 * i));
    EXPECT_TRUE((*map)->process(flown.back()).localised) << "M begins where W does";
  }
  (*map)->finish();
  EXPECT_EQ((*map)->keyframes(), 4);
  EXPECT_EQ((*map)->corrected({{flown[0].t, flown[0].gauge.T_GB}, {flown[1].t, flown[1].gauge.T_GB}}).size(), 2u);
  ASSERT_TRUE((*map)->save(path_).ok());

  auto again = LoopMap::create(test_room::rig(), {.file = path_});
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ((*again)->keyframes(), 4);
  bool localised = false;
  for (int i = 0; i < 3; ++i) {
    Keyframe k = before_a_wall(10 + i, 0.05 + 0.15 * i);
    const Vec3 p_M = k.gauge.T_GB.p;
    k.gauge.T_GB.p += Vec3(5, -3, 1);
    const MapUpdate update = (*again)->process(k);
    if (!update.localised) continue;
    localised = true;
    EXPECT_LT(((update.T_MG * k.gauge.T_GB).p - p_M).norm(), 0.05);
  }
  EXPECT_TRUE(localised);
}

/// Cameras 0 and 2 are the pair, camera 1 looks backwards and sees nothing; then camera 2 looks elsewhere.
TEST_F(OpenedMap, IsMadeByThePairWhicheverItsNumbers) {
  const StereoRig pair = test_room::rig();
  MountedCamera behind = pair.mounted(0);
  behind.T_BC.q = Quat(Eigen::AngleAxisd(M_PI, Vec3::UnitZ())) * behind.T_BC.q;
  behind.T_BC.p.x() -= 0.1;
  const StereoRig three = with_cameras(pair, {pair.mounted(0), behind, pair.mounted(1)});
  const auto made = [&](const StereoRig& rig, bool of_three) {
    auto map = LoopMap::create(rig);
    EXPECT_TRUE(map.ok()) << map.error().message;
    for (int i = 0; i < 2; ++i) {
      Keyframe k = before_a_wall(i, 0.15 * i);
      if (of_three) k.images.images.insert(k.images.images.begin() + 1, std::make_shared<const Image>(752, 480));
      if (!rig.has_right()) k.images.set_image(1, nullptr);
      (*map)->process(k);
    }
    (*map)->finish();
    return *(*map)->bytes();
  };
  EXPECT_TRUE(made(three, true) == made(pair, false));
  const StereoRig apart = with_cameras(
      pair, {pair.mounted(0), behind, {behind.camera, {pair.T_BC0().q * Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitY())), {}}}});
  const std::string bytes = made(apart, true);
  const auto map = parse_map(std::as_bytes(std::span(bytes)), "apart");
  ASSERT_TRUE(map.ok()) << map.error().message;
  ASSERT_EQ(map->size(), 2u);
  EXPECT_EQ(map->T_BC(map->keyframes()[1]).p, behind.T_BC.p) << "none sees what another does: each has its turn";
}

TEST_F(OpenedMap, SaysWhatIsWrong) {
  EXPECT_FALSE(LoopMap::create(test_room::rig(), {.file = path_}).ok()) << "there is no such map";
  EXPECT_FALSE(LoopMap::create(test_room::rig(), {.vocabulary = path_}).ok()) << "there are no such words";
  const auto other_words = LoopMap::create(test_room::rig(), {.vocabulary = shipped_vocabulary(kBoostedDescriptors)});
  ASSERT_FALSE(other_words.ok());
  EXPECT_NE(other_words.error().message.find("boosted"), std::string::npos);
  LoopOptions options;
  options.max_keyframes = 1;
  const auto small = LoopMap::create(test_room::rig(), {.loop = options});
  ASSERT_FALSE(small.ok());
  EXPECT_NE(small.error().message.find("max_keyframes"), std::string::npos);
}

}  // namespace loop_map_test
}  // namespace fbvins
