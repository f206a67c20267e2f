// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/frame_joiner.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace fbvins {
namespace frame_joiner_test {

/// "2 3L 4R": frames by tens of milliseconds, alone where a letter says so.
class Pairs {
 public:
  void left(double tens) { add(0, tens); }
  void right(double tens) { add(1, tens); }
  std::string report() const { return joiner_.report(); }
  std::string given;

 private:
  void add(int camera, double tens) {
    joiner_.add(camera, Time{static_cast<std::int64_t>(tens * 1e7)}, std::make_shared<Image>(1, 1));
    while (const auto frame = joiner_.next()) {
      if (!given.empty()) given += " ";
      given += std::to_string(frame->t.ns / 10'000'000);
      if (!frame->right) given += "L";
      if (!frame->left) given += "R";
      if (const Duration offset = frame->offsets.of(1); offset.ns != 0) given += std::to_string(offset.ns / 1'000'000);
    }
  }
  FrameJoiner joiner_{2};
};

TEST(FrameJoiner, PartnersMeetInEitherOrder) {
  Pairs p;
  p.left(1), p.right(1), p.right(2), p.left(2), p.left(3), p.right(3.1);
  EXPECT_EQ(p.given, "1 2 3");
}

TEST(FrameJoiner, OneCameraMayLagByAFrame) {
  Pairs p;
  p.left(1), p.left(2), p.right(1), p.left(3), p.right(2), p.right(3);
  EXPECT_EQ(p.given, "1 2 3");
}

TEST(FrameJoiner, ALostImageLeavesItsPartnerAlone) {
  Pairs p;
  p.left(1), p.right(1), p.left(2), p.left(3), p.right(3), p.right(4), p.left(5), p.right(5);
  EXPECT_EQ(p.given, "1 2L 3 4R 5");
}

TEST(FrameJoiner, ASilentCameraDelaysTheOtherBoundedly) {
  Pairs p;
  for (int k = 1; k <= 8; ++k) p.right(k);
  EXPECT_EQ(p.given, "1R 2R 3R 4R 5R");
  p.left(8);
  EXPECT_EQ(p.given, "1R 2R 3R 4R 5R 6R 7R 8");
}

TEST(FrameJoiner, StampsOfAPairMayDifferALittle) {
  Pairs p;
  for (int k = 1; k <= 5; ++k) p.left(k), p.right(k + 1.2e-4);  // 1.2 us later
  p.left(6), p.right(5.9), p.right(7.3), p.left(7);
  EXPECT_EQ(p.given, "1 2 3 4 5 6 7") << "3 ms, as in recordings";
}

TEST(FrameJoiner, WhatIsTooFarAndTooNearIsDroppedAndCounted) {
  Pairs p;
  p.left(1), p.right(1), p.left(2), p.right(2.4), p.left(3), p.right(3), p.right(3.6), p.left(4), p.left(5), p.right(5);
  EXPECT_EQ(p.given, "1 2L 3 4L 5") << "neither 2.4 nor 3.6 is a moment of its own";
  EXPECT_EQ(p.report(),
            "3 frames with the images of all cameras; 2 with those of some, 2 images dropped, without partner within 3 ms");
  Pairs good;
  good.left(1), good.right(1);
  EXPECT_EQ(good.report(), "");
}

TEST(FrameJoiner, WithoutACommonTriggerTheOffsetIsKept) {
  Pairs p;
  for (int k = 1; k <= 12; ++k) p.right(k + 0.6), p.left(k + 1);
  p.given = "";
  p.right(13.6), p.left(14), p.right(14.6), p.left(15), p.left(16), p.right(16.4);
  EXPECT_EQ(p.given, "14-4 15-4 16L") << "no image waits for one that would be later";
  p.given = "";
  p.right(17.4), p.left(17.2), p.left(18.2), p.right(18.4), p.left(19.2);
  EXPECT_EQ(p.given, "17-8 182") << "not the newest one, but the nearest to a quarter of an interval before";
}

TEST(FrameJoiner, WithoutACommonTriggerASilentCameraDelaysNothingForLong) {
  Pairs p;
  for (int k = 1; k <= 12; ++k) p.right(k + 0.6), p.left(k + 1);
  p.given = "";
  for (int k = 14; k <= 19; ++k) p.left(k);
  EXPECT_EQ(p.given, "14L 15L 16L");
  p.given = "";
  for (int k = 20; k <= 25; ++k) p.right(k);
  EXPECT_EQ(p.given.substr(0, 11), "17L 18L 19L");
}

TEST(FrameJoiner, AStampThatGoesBackIsDropped) {
  Pairs p;
  p.left(3), p.left(2), p.left(3), p.right(3);
  EXPECT_EQ(p.given, "3");
}

/// Of several cameras: "1:012 2:02" are the numbers of those whose images a frame has, "d" for a depth image; behind a camera its
/// offset in ms.
class Several {
 public:
  explicit Several(int cameras, bool depth = false) : joiner_(cameras, depth) {}
  void image(int camera, double tens) {
    joiner_.add(camera, at(tens), std::make_shared<Image>(1, 1));
    take();
  }
  void all(int cameras, double tens) {
    for (int i = 0; i < cameras; ++i) image(i, tens);
  }
  void depth(double tens) {
    joiner_.add_depth(at(tens), std::make_shared<DepthImage>());
    take();
  }
  bool without_trigger(int camera) const { return joiner_.without_trigger(camera); }
  std::string given;

 private:
  static Time at(double tens) { return Time{static_cast<std::int64_t>(tens * 1e7)}; }
  void take() {
    while (const auto frame = joiner_.next()) {
      if (!given.empty()) given += " ";
      given += std::to_string(frame->t.ns / 10'000'000) + ":";
      for (int i = 0; i < 2 + static_cast<int>(frame->more.size()); ++i) {
        if (!frame->image(i)) continue;
        given += std::to_string(i);
        if (const Duration offset = frame->offsets.of(i); offset.ns != 0) given += std::to_string(offset.ns / 1'000'000);
      }
      if (frame->depth) given += "d";
    }
  }
  FrameJoiner joiner_;
};

TEST(FrameJoiner, FourCamerasMeetInAnyOrder) {
  Several s(4);
  s.image(3, 1), s.image(0, 1), s.image(2, 1.01), s.image(1, 1);
  for (const int i : {1, 0, 3, 2}) s.image(i, 2);
  EXPECT_EQ(s.given, "1:0123 2:0123");
}

TEST(FrameJoiner, TheOthersGoOnWithoutACamera) {
  Several s(4);
  s.all(4, 1);
  for (const int i : {0, 1, 3}) s.image(i, 2);
  EXPECT_EQ(s.given, "1:0123") << "it may still come";
  s.all(4, 3);
  EXPECT_EQ(s.given, "1:0123 2:013 3:0123");
  s.given = "";
  for (int k = 4; k <= 8; ++k)
    for (const int i : {0, 1, 3}) s.image(i, k);
  EXPECT_EQ(s.given, "4:013 5:013") << "it is waited for, but not for long";
}

TEST(FrameJoiner, ACameraWithoutACommonTriggerJoinsThePair) {
  Several s(3);
  for (int k = 1; k <= 25; ++k) s.image(2, k + 0.6), s.image(0, k + 1), s.image(1, k + 1);
  EXPECT_TRUE(s.without_trigger(2) && !s.without_trigger(1));
  s.given = "";
  s.image(2, 26.6), s.image(0, 27), s.image(1, 27), s.image(0, 28), s.image(1, 28), s.image(2, 28.4);
  EXPECT_EQ(s.given, "27:012-4 28:01");
}

TEST(FrameJoiner, DepthImagesGoWithTheirCamera) {
  Several s(1, true);
  s.image(0, 1), s.depth(1), s.depth(2), s.image(0, 2), s.depth(3), s.depth(4), s.image(0, 4), s.image(0, 5), s.image(0, 6),
      s.depth(6);
  EXPECT_EQ(s.given, "1:0d 2:0d 4:0d 5:0 6:0d");
}

}  // namespace frame_joiner_test
}  // namespace fbvins
