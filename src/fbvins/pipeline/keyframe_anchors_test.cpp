// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/keyframe_anchors.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace keyframe_anchors_test {

Anchor at(std::int64_t ns) { return PositionAnchor{.t = Time{ns}}; }

std::vector<std::int64_t> stamps(const std::vector<Anchor>& anchors) {
  std::vector<std::int64_t> out;
  for (const Anchor& a : anchors) out.push_back(stamp_of(a).ns);
  return out;
}

using Stamps = std::vector<std::int64_t>;

TEST(KeyframeAnchors, WaitForTheKeyframeThatFollowsThem) {
  KeyframeAnchors anchors;
  anchors.add({at(10), at(40), at(20)});
  EXPECT_EQ(stamps(anchors.until(Time{30})), (Stamps{10, 20}));
  anchors.add({at(25)});
  EXPECT_EQ(stamps(anchors.until(Time{40})), (Stamps{25, 40})) << "late, but not lost";
  EXPECT_TRUE(anchors.until(Time{100}).empty());
}

TEST(KeyframeAnchors, OfAKeyframeThatIsLeftOutGoToTheNext) {
  KeyframeAnchors anchors;
  anchors.add({at(10), at(40)});
  anchors.add(anchors.until(Time{30}));
  EXPECT_EQ(stamps(anchors.until(Time{50})), (Stamps{10, 40}));
}

TEST(KeyframeAnchors, OldOnesAreDropped) {
  KeyframeAnchors anchors;
  for (int i = 0; i < 3000; ++i) anchors.add({at(i)});
  const auto kept = stamps(anchors.until(Time{5000}));
  ASSERT_EQ(kept.size(), 1024u);
  EXPECT_EQ(kept.back(), 2999);
}

}  // namespace keyframe_anchors_test
}  // namespace fbvins
