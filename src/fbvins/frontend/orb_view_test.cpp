// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_view.hpp"

#include <gtest/gtest.h>

#include "tests/support/noise_texture.hpp"

namespace fbvins {
namespace orb_view_test {

/// Inverts every bit.
class Inverter final : public DescriptorStage {
 public:
  void improve(int, int, OrbFeatures& features) override {
    for (Descriptor& d : features.descriptors)
      for (std::uint64_t& bits : d.bits) bits = ~bits;
  }
  bool changes_descriptors() const override { return true; }
};

Image textured() {
  return render_texture(
      200, 160, NoiseTexture(5, 20), [](const Vec2& px) { return px; }, 120, 35);
}

TEST(OrbDescriber, KeepsDescriptorsAsExtractedBesideTheImprovedOnes) {
  const Image image = textured();
  OrbView plain, improved;
  OrbDescriber(OrbOptions{}, make_identity_stage()).describe(image.view(), plain);
  OrbDescriber(OrbOptions{}, std::make_unique<Inverter>()).describe(image.view(), improved);
  ASSERT_GT(plain.features.size(), 50u);
  ASSERT_EQ(improved.features.size(), plain.features.size());
  EXPECT_FALSE(plain.improved);
  for (std::size_t k = 0; k < plain.features.size(); ++k) {
    EXPECT_EQ(improved.raw_descriptor(k), plain.descriptor(k));
    EXPECT_EQ(hamming_distance(improved.descriptor(k), plain.descriptor(k)), 256);
  }
}

TEST(OrbDescriber, NoKeypointOfANewImageIsUsed) {
  const Image image = textured();
  OrbDescriber describer(OrbOptions{}, make_identity_stage());
  OrbView view;
  describer.describe(image.view(), view);
  view.used.assign(view.used.size(), 1);
  describer.describe(image.view(), view);
  EXPECT_EQ(view.used, std::vector<std::uint8_t>(view.features.size(), 0));
  std::vector<std::int32_t> near;
  view.grid.near(view.features.keypoints[0].pixel, 1, view.features.keypoints[0].level, view.features.keypoints, near);
  EXPECT_FALSE(near.empty());
}

}  // namespace orb_view_test
}  // namespace fbvins
