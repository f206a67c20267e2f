// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_view.hpp"

#include <gtest/gtest.h>

#include "fbvins/frontend/orb_improver.hpp"
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

TEST(OrbDescriber, LeavesDescriptorsAsExtractedUntilTheyAreImproved) {
  const Image image = textured();
  OrbView plain, view;
  const auto stage = std::make_shared<Inverter>();
  OrbDescriber(OrbOptions{}, make_identity_stage()).describe(image.view(), plain);
  OrbDescriber(OrbOptions{}, stage).describe(image.view(), view);
  ASSERT_GT(plain.features.size(), 50u);
  EXPECT_FALSE(plain.improves);
  EXPECT_EQ(view.descriptors, plain.features.descriptors);
  const Keypoint& first = view.features.keypoints[0];
  const GuidedQuery query{.px = first.pixel, .radius_px = 0.5, .level = first.level, .raw = view.raw_descriptor(0)};
  OrbImprover(stage).improve_similar({{query}}, view);
  for (std::size_t k = 0; k < plain.features.size(); ++k) {
    EXPECT_EQ(view.raw_descriptor(k), plain.descriptor(k));
    EXPECT_EQ(hamming_distance(view.descriptor(k), plain.descriptor(k)), view.improved[k] != 0 ? 256 : 0);
  }
  EXPECT_EQ(view.improved[0], 1);
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
