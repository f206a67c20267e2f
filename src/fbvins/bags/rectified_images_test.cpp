// SPDX-License-Identifier: Apache-2.0
// Pairs of images whose topics' names do and do not say what they show.
#include <gtest/gtest.h>

#include "fbvins/bags/rectified_images.hpp"
#include "fbvins/geometry/so3.hpp"
#include "tests/support/noise_texture.hpp"

namespace fbvins {
namespace rectified_images_test {

constexpr int kWidth = 480, kHeight = 320;
constexpr double kDepth_m = 2, kBaseline_m = 0.12;

/// From a camera of the body's axes to the rectified one.
const Mat3& turned(int i) {
  static const std::array<Mat3, 2> R{so3_exp({0.01, 0.02, -0.01}).toRotationMatrix(),
                                     so3_exp({-0.015, -0.01, 0.01}).toRotationMatrix()};
  return R[static_cast<std::size_t>(i)];
}

Camera raw_lens() {
  return Camera(PinholeRadtan{.fx = 260, .fy = 260, .cx = 238, .cy = 161, .k1 = -0.25, .k2 = 0.06}, kWidth, kHeight);
}
Camera straight_lens() { return Camera(PinholeRadtan{.fx = 240, .fy = 240, .cx = 240, .cy = 160}, kWidth, kHeight); }

/// A wall ahead of the rectified cameras.
Image wall(int camera, bool rectified, std::uint64_t noise_seed) {
  static const NoiseTexture texture{7, 24};
  const Camera lens = rectified ? straight_lens() : raw_lens();
  const auto warp = [&](const Vec2& px) {
    const auto normalised = lens.undistort(px);
    Vec3 ray = normalised ? Vec3(normalised->x(), normalised->y(), 1) : Vec3(0, 0, 1);
    if (!rectified) ray = turned(camera) * ray;
    return Vec2(260 * (ray.head<2>() / ray.z() + Vec2(camera * kBaseline_m / kDepth_m, 0)));
  };
  return render_texture(kWidth, kHeight, texture, warp, 120, 35, 1.0, noise_seed);
}

class Walls : public FrameLoader {
 public:
  explicit Walls(bool rectified) : rectified_(rectified) {}
  LoadedFrame load(const FrameEntry& entry) override {
    LoadedFrame out;
    out.frame.t = entry.t;
    for (int i = 0; i < 2; ++i)
      out.frame.set_image(i, std::make_shared<const Image>(wall(i, rectified_, static_cast<std::uint64_t>(2 * entry.t.ns + i))));
    return out;
  }

 private:
  bool rectified_;
};

/// Judged by topics of this name; `rectified`: what the images show.
DatasetContents judged(const std::string& name, bool rectified) {
  BagContents contents;
  contents.imu["/imu"].frame = "imu";
  ChosenTopics topics{{}, "/imu", "", ""};
  for (int i = 0; i < 2; ++i) {
    const std::string folder = i == 0 ? "/left" : "/right";
    topics.cameras.push_back(folder + "/" + name);
    contents.images[topics.cameras.back()];
    contents.cameras[folder + "/camera_info"] = {raw_lens(), folder,
                                                 BagCamera::Rectified{straight_lens(), turned(i), i * kBaseline_m}};
    contents.transforms.push_back({"imu", folder, Quat(turned(i)), Vec3(i * kBaseline_m, 0, 0)});
  }
  DatasetContents out;
  out.rig = *rig_of(contents, topics);
  for (int i = 0; i < 20; ++i) out.frames.push_back({Time{i}, {"left", "right"}});
  out.loader = std::make_unique<Walls>(rectified);
  judge_rectified(contents, topics, "", out);
  return out;
}

double focal_length(const DatasetContents& recording) { return recording.rig.left().intrinsics()[0]; }

TEST(RectifiedImages, NamesThatAreRightAreKept) {
  const DatasetContents raw = judged("image_raw", false), rectified = judged("image_rect", true);
  EXPECT_EQ(focal_length(raw), 260);
  EXPECT_TRUE(raw.info.warnings.empty());
  EXPECT_EQ(focal_length(rectified), 240);
  ASSERT_EQ(rectified.info.warnings.size(), 1U);
  EXPECT_EQ(rectified.info.warnings[0],
            "the images on /left/image_rect, /right/image_rect are taken as rectified by their name: R "
            "and P of camera_info are used, not K and D");
}

TEST(RectifiedImages, ImagesContradictTheirNames) {
  const DatasetContents rectified = judged("image_raw", true), raw = judged("image_rect", false);
  EXPECT_EQ(focal_length(rectified), 240);
  EXPECT_LT((rectified.rig.T_BC1().R() - Mat3::Identity()).norm(), 1e-9);
  ASSERT_EQ(rectified.info.warnings.size(), 1U);
  EXPECT_EQ(rectified.info.warnings[0],
            "the images on /left/image_raw, /right/image_raw are rectified by what they show, not raw as "
            "their names say: R and P of camera_info are used");
  EXPECT_EQ(focal_length(raw), 260);
  ASSERT_EQ(raw.info.warnings.size(), 1U);
  EXPECT_NE(raw.info.warnings[0].find("are raw by what they show, not rectified as their names say: K and D"), std::string::npos);
}

}  // namespace rectified_images_test
}  // namespace fbvins
