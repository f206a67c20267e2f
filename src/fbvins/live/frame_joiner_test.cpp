// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/frame_joiner.hpp"

#include <gtest/gtest.h>

#include <string>

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
      if (!frame->right()) given += "L";
      if (!frame->left()) given += "R";
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
  for (int k = 14; k <= 15; ++k) p.left(k);
  EXPECT_EQ(p.given, "") << "it may still come";
  for (int k = 16; k <= 19; ++k) p.left(k);
  EXPECT_EQ(p.given, "14L 15L 16L 17L 18L 19L");
  p.given = "";
  for (int k = 20; k <= 25; ++k) p.right(k);
  EXPECT_EQ(p.given, "20R 21R 22R 23R 24R 25R");
}

TEST(FrameJoiner, ASilentCameraDelaysNothing) {
  Pairs p;
  for (int k = 1; k <= 10; ++k) p.left(k), p.right(k);
  p.given = "";
  p.left(11), p.left(12);
  EXPECT_EQ(p.given, "") << "it may still come";
  p.left(13);
  EXPECT_EQ(p.given, "11L 12L 13L");
  p.left(14);
  EXPECT_EQ(p.given, "11L 12L 13L 14L") << "at once";
  for (int k = 15; k <= 60; ++k) p.left(k);
  p.given = "";
  p.right(60.1), p.left(61), p.right(61), p.right(62), p.left(62);
  EXPECT_EQ(p.given, "61 62") << "the image whose frame has gone is dropped, and the camera is there again";
  p.given = "";
  p.left(63), p.left(64), p.left(65), p.left(66);
  EXPECT_EQ(p.given, "63L 64L 65L 66L") << "the gap before is no period";
}

/// Its images come two after the other camera's, always.
TEST(FrameJoiner, ALateCameraIsNoSilentOne) {
  Pairs p;
  p.left(1), p.left(2);
  for (int k = 3; k <= 40; ++k) p.left(k), p.right(k - 2);
  std::string all;
  for (int k = 1; k <= 38; ++k) all += (k > 1 ? " " : "") + std::to_string(k);
  EXPECT_EQ(p.given, all);
}

TEST(FrameJoiner, OneLostImageCostsNoOther) {
  Pairs p;
  for (int k = 1; k <= 10; ++k) p.left(k), p.right(k);
  p.given = "";
  p.left(11), p.left(12), p.right(12), p.left(13), p.right(13);
  EXPECT_EQ(p.given, "11L 12 13");
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
      for (int i = 0; i < static_cast<int>(frame->images.size()); ++i) {
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

TEST(FrameJoiner, TheOthersGoOnAtOnceWithoutASilentCameraAndItComesBack) {
  Several s(4);
  for (int k = 1; k <= 8; ++k) s.all(4, k);
  for (int k = 9; k <= 11; ++k)
    for (const int i : {0, 1, 3}) s.image(i, k);
  s.given = "";
  for (const int i : {3, 0}) s.image(i, 12);
  EXPECT_EQ(s.given, "") << "the others are waited for";
  s.image(1, 12);
  EXPECT_EQ(s.given, "12:013");
  s.given = "";
  s.image(2, 13), s.image(0, 13), s.image(1, 13), s.image(3, 13);
  EXPECT_EQ(s.given, "13:0123");
}

TEST(FrameJoiner, ACameraThatNeverDeliversDelaysNothingAfterASecond) {
  Several s(2);
  for (int k = 1; k <= 99; ++k) s.image(0, k);
  EXPECT_TRUE(s.given.ends_with("95:0 96:0")) << s.given;
  for (int k = 100; k <= 103; ++k) s.image(0, k);
  EXPECT_TRUE(s.given.ends_with("102:0 103:0")) << s.given;
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

TEST(FrameJoiner, StampsThatTheCalibrationExplainsAreOfOneInstant) {
  const ExposureOffsets own({{}, Duration{-8'000'000}, Duration{3'000'000}});
  FrameJoiner joiner(3, false, Duration{3'000'000}, own);
  std::string given;
  const auto add = [&](int camera, int ms) {
    joiner.add(camera, Time{ms * std::int64_t{1'000'000}}, std::make_shared<Image>(1, 1));
    while (auto frame = joiner.next()) {
      EXPECT_EQ(frame->offsets.of(1).ns, 8'000'000);
      EXPECT_EQ(frame->offsets.of(2).ns, -3'000'000);
      frame->offsets += own;
      EXPECT_TRUE(frame->offsets.all_zero());
      given += std::to_string(frame->t.ns / 1'000'000) + (frame->left() && frame->right() && frame->image(2) ? " " : "? ");
    }
  };
  for (int k = 1; k < 5; ++k) add(2, 50 * k - 3), add(0, 50 * k), add(1, 50 * k + 8);
  EXPECT_EQ(given, "50 100 150 200 ");
}

}  // namespace frame_joiner_test
}  // namespace fbvins
