// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/mask_fields.hpp"

#include <gtest/gtest.h>

#include "fbvins/io/calibration.hpp"
#include "fbvins/io/png_encode.hpp"
#include "fbvins/io/rig_text.hpp"

namespace fbvins {
namespace mask_fields_test {

constexpr int kWidth = 64, kHeight = 48;

std::string sensor(const std::string& mask) {
  return "T_BS: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: 20\nresolution: [64, 48]\ncamera_model: pinhole\n"
         "intrinsics: [40, 41, 31, 23]\ndistortion_model: none\n" +
         mask;
}

std::string chain(const std::string& mask0, const std::string& mask1) {
  const auto camera = [](const std::string& mask, double x_m) {
    return "  T_cam_imu: [1, 0, 0, " + std::to_string(x_m) +
           ", 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n  resolution: [64, 48]\n  camera_model: pinhole\n"
           "  intrinsics: [40, 41, 31, 23]\n  distortion_model: none\n" +
           mask;
  };
  return "cam0:\n" + camera(mask0, 0) + "cam1:\n" + camera(mask1, -0.1);
}

/// As a file system with these files.
ReadBeside holding(const std::string& name, const std::string& bytes) {
  return [=](const std::string& wanted) -> Result<std::string> {
    if (wanted == name) return bytes;
    return Error{ErrorCode::not_found, wanted + ": no such file"};
  };
}

std::string png_of(const Image& image) { return encode_png(image); }

Image with_bar() {
  Image seen(kWidth, kHeight, 255);
  hide(seen, MaskRectangle{20, 40, 10, 8});
  return seen;
}

TEST(MaskFields, APictureAndShapesHideTogether) {
  const auto camera = parse_euroc_camera({"cam0", sensor("mask: m/mask.png\nmask_rectangles: [[0, 0, 4, 2], [60, 44, 4, 4]]\n"
                                                         "mask_circles: [[32, 5, 1]]\n")},
                                         holding("m/mask.png", png_of(with_bar())));
  ASSERT_TRUE(camera) << camera.error().message;
  const Mask& mask = *camera->camera.mask();
  EXPECT_TRUE(mask.hides({25, 42}));
  EXPECT_TRUE(mask.hides({3, 1}));
  EXPECT_TRUE(mask.hides({63, 47}));
  EXPECT_TRUE(mask.hides({32, 6}));
  EXPECT_DOUBLE_EQ(mask.hidden_share() * kWidth * kHeight, 80 + 8 + 16 + 5);
}

TEST(MaskFields, ACameraWithoutThemHasNoMask) {
  EXPECT_EQ(parse_euroc_camera({"cam0", sensor("")})->camera.mask(), nullptr);
  EXPECT_EQ(parse_euroc_camera({"cam0", sensor("mask_rectangles: []\n")})->camera.mask(), nullptr);
  const auto white = parse_euroc_camera({"cam0", sensor("mask: m.png\n")}, holding("m.png", png_of(Image(64, 48, 250))));
  ASSERT_TRUE(white);
  EXPECT_EQ(white->camera.mask(), nullptr);
}

TEST(MaskFields, KalibrsCamerasHaveThemToo) {
  const auto rig = parse_kalibr_camchain({"c.yaml", chain("  mask_circles: [[10, 10, 3]]\n", "  mask: right.png\n")},
                                         holding("right.png", png_of(with_bar())));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_TRUE(rig->left().mask()->hides({10, 13}));
  EXPECT_TRUE(rig->right().mask()->hides({25, 42}));
  EXPECT_FALSE(rig->right().mask()->hides({10, 13}));
}

TEST(MaskFields, SayWhatIsWrong) {
  const struct {
    std::string fields, png, sentence;
  } all[] = {
      {"mask: other.png\n", "", "c.yaml:7: mask: other.png: no such file"},
      {"mask: m.png\n", "no picture", "c.yaml:7: mask: m.png: "},
      {"mask: m.png\n", png_of(Image(32, 48, 0)), "c.yaml:7: mask: m.png has 32 x 48 pixels, the camera 64 x 48"},
      {"mask: m.png\n", png_of(Image(64, 48, 10)), "c.yaml:7: mask: hides all of the image"},
      {"mask: [m.png]\n", "", "c.yaml:7: mask: is not a word"},
      {"mask_rectangles: 5\n", "", "c.yaml:7: mask_rectangles: is not a list of at most 5000 shapes [x, y, width, height]"},
      {"mask_rectangles: [1, 2, 3, 4]\n", "", "c.yaml:7: mask_rectangles: its number 1 is not [x, y, width, height]"},
      {"mask_rectangles: [[0, 0, 9, 9], [1, 2, 3]]\n", "", "c.yaml:7: mask_rectangles: its number 2 is not"},
      {"mask_rectangles: [[0, 0, 9, nan]]\n", "", "c.yaml:7: mask_rectangles: its number 1 is not"},
      {"mask_rectangles: [[0, 0, 9, x]]\n", "", "c.yaml:7: mask_rectangles: its number 1 is not"},
      {"mask_rectangles: [[64, 0, 9, 9]]\n", "",
       "c.yaml:7: mask_rectangles: its number 1 holds no pixel of the image of 64 x 48"},
      {"mask_rectangles: [[0, 0, -9, 9]]\n", "", "c.yaml:7: mask_rectangles: its number 1 holds no pixel"},
      {"mask_rectangles: [[0, 0, 64, 48]]\n", "", "c.yaml:7: mask_rectangles: hides all of the image"},
      {"mask_circles: [[1, 2, 3, 4]]\n", "", "c.yaml:7: mask_circles: its number 1 is not [x, y, radius]"},
      {"mask_circles: [[1, 2, 0]]\n", "", "c.yaml:7: mask_circles: its number 1 holds no pixel"},
      {"mask_circles: [[500, 2, 9]]\n", "", "c.yaml:7: mask_circles: its number 1 holds no pixel"},
  };
  for (const auto& wrong : all) {
    const auto camera = parse_euroc_camera({"c.yaml", sensor(wrong.fields)}, holding("m.png", wrong.png));
    ASSERT_FALSE(camera) << wrong.fields;
    EXPECT_EQ(camera.error().message.rfind(wrong.sentence, 0), 0u) << camera.error().message;
  }
  const auto none = parse_euroc_camera({"c.yaml", sensor("mask: m.png\n")});
  EXPECT_EQ(none.error().message, "c.yaml:7: mask: names a file, and here no file belongs to the calibration");
}

TEST(MaskFields, APhotographIsNotAMask) {
  const auto ramp = [&] {
    Image image(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) image.at(x, y) = static_cast<std::uint8_t>(3 * x);
    return png_of(image);
  };
  EXPECT_EQ(parse_euroc_camera({"c.yaml", sensor("mask: m.png\n")}, holding("m.png", ramp())).error().message,
            "c.yaml:7: mask: m.png is no mask: 83 % of it is neither black nor white");
  Image picture(320, 240, 255);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) picture.at(x, y) = static_cast<std::uint8_t>((x + y) % 2 * 255);
  std::string text = sensor("mask: m.png\n");
  text.replace(text.find("[64, 48]"), 8, "[320, 240]");
  const auto camera = parse_euroc_camera({"c.yaml", text}, holding("m.png", png_of(picture)));
  EXPECT_EQ(camera.error().message, "c.yaml:7: mask: m.png is no mask: it has more than 5000 separate parts");
}

TEST(MaskFields, ARigAsTextKeepsItsMasks) {
  auto rig = parse_kalibr_camchain({"c.yaml", chain("  mask_circles: [[10, 10, 3]]\n", "  mask: right.png\n")},
                                   holding("right.png", png_of(with_bar())));
  ASSERT_TRUE(rig);
  const auto back = parse_rig(rig_to_yaml(*rig), "rig.yaml");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->left().mask()->rectangles(), rig->left().mask()->rectangles());
  EXPECT_EQ(back->right().mask()->rectangles(), rig->right().mask()->rectangles());
  rig->cameras[1].camera.set_mask(nullptr);
  EXPECT_EQ(parse_rig(rig_to_yaml(*rig), "rig.yaml")->right().mask(), nullptr);
}

}  // namespace mask_fields_test
}  // namespace fbvins
