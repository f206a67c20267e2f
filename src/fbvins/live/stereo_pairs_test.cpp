// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/stereo_pairs.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace fbvins {
namespace stereo_pairs_test {

/// "2 3L 4R": frames by tens of milliseconds, alone where a letter says so.
class Pairs {
 public:
  void left(double tens) { add(0, tens); }
  void right(double tens) { add(1, tens); }
  std::string given;

 private:
  void add(int camera, double tens) {
    pairs_.add(camera, Time{static_cast<std::int64_t>(tens * 1e7)}, std::make_shared<Image>(1, 1));
    while (const auto frame = pairs_.next()) {
      if (!given.empty()) given += " ";
      given += std::to_string(frame->t.ns / 10'000'000);
      if (!frame->right) given += "L";
      if (!frame->left) given += "R";
      if (const Duration offset = frame->offsets.of(1); offset.ns != 0) given += std::to_string(offset.ns / 1'000'000);
    }
  }
  StereoPairs pairs_;
};

TEST(StereoPairs, PartnersMeetInEitherOrder) {
  Pairs p;
  p.left(1), p.right(1), p.right(2), p.left(2), p.left(3), p.right(3.1);
  EXPECT_EQ(p.given, "1 2 3");
}

TEST(StereoPairs, OneCameraMayLagByAFrame) {
  Pairs p;
  p.left(1), p.left(2), p.right(1), p.left(3), p.right(2), p.right(3);
  EXPECT_EQ(p.given, "1 2 3");
}

TEST(StereoPairs, ALostImageLeavesItsPartnerAlone) {
  Pairs p;
  p.left(1), p.right(1), p.left(2), p.left(3), p.right(3), p.right(4), p.left(5), p.right(5);
  EXPECT_EQ(p.given, "1 2L 3 4R 5");
}

TEST(StereoPairs, ASilentCameraDelaysTheOtherBoundedly) {
  Pairs p;
  for (int k = 1; k <= 8; ++k) p.right(k);
  EXPECT_EQ(p.given, "1R 2R 3R 4R 5R");
  p.left(8);
  EXPECT_EQ(p.given, "1R 2R 3R 4R 5R 6R 7R 8");
}

TEST(StereoPairs, StampsOfAPairMayDifferALittle) {
  Pairs p;
  for (int k = 1; k <= 5; ++k) p.left(k), p.right(k + 1.2e-4);  // 1.2 us later
  p.left(6), p.right(5.9), p.right(7.3), p.left(7);
  EXPECT_EQ(p.given, "1 2 3 4 5 6 7L");
}

TEST(StereoPairs, WithoutACommonTriggerTheOffsetIsKept) {
  Pairs p;
  for (int k = 1; k <= 12; ++k) p.right(k + 0.6), p.left(k + 1);
  p.given = "";
  p.right(13.6), p.left(14), p.right(14.6), p.left(15), p.left(16), p.right(16.4);
  EXPECT_EQ(p.given, "14-4 15-4 16L") << "no image waits for one that would be later";
  p.given = "";
  p.right(17.4), p.left(17.2), p.left(18.2), p.right(18.4), p.left(19.2);
  EXPECT_EQ(p.given, "17-8 182") << "not the newest one, but the nearest to a quarter of an interval before";
}

TEST(StereoPairs, WithoutACommonTriggerASilentCameraDelaysNothingForLong) {
  Pairs p;
  for (int k = 1; k <= 12; ++k) p.right(k + 0.6), p.left(k + 1);
  p.given = "";
  for (int k = 14; k <= 19; ++k) p.left(k);
  EXPECT_EQ(p.given, "14L 15L 16L");
  p.given = "";
  for (int k = 20; k <= 25; ++k) p.right(k);
  EXPECT_EQ(p.given.substr(0, 11), "17L 18L 19L");
}

TEST(StereoPairs, AStampThatGoesBackIsDropped) {
  Pairs p;
  p.left(3), p.left(2), p.left(3), p.right(3);
  EXPECT_EQ(p.given, "3");
}

}  // namespace stereo_pairs_test
}  // namespace fbvins
