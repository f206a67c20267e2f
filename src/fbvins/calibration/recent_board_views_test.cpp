// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/recent_board_views.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace recent_board_views_test {

constexpr int kWidth_px = 640;

Time at(int image) { return Time{1'000'000'000 + image * 100'000'000ll}; }

BoardDetection board_at(double u_px) {
  BoardDetection out;
  for (int i = 0; i < 16; ++i) out.corners.push_back({i, Vec2(u_px + 20.0 * (i % 4), 100 + 20.0 * (i / 4))});
  out.tags = 4;
  return out;
}

TEST(RecentBoardViews, ABoardInViewNeedsNoAdvice) {
  RecentBoardViews recent;
  for (int i = 0; i < 10; ++i) recent.add(0, at(i), kWidth_px, board_at(100 + 5 * i));
  EXPECT_EQ(recent.advice(), "");
  ASSERT_EQ(recent.now().size(), 1u);
  EXPECT_EQ(recent.now()[0].t, at(9));
}

TEST(RecentBoardViews, OneCameraThatSeesItIsEnough) {
  RecentBoardViews recent;
  for (int i = 0; i < 10; ++i)
    for (const int camera : {0, 1}) recent.add(camera, at(i), kWidth_px, camera == 1 ? board_at(100) : BoardDetection{});
  EXPECT_EQ(recent.advice(), "");
  ASSERT_EQ(recent.now().size(), 1u);
  EXPECT_EQ(recent.now()[0].camera, 1);
}

TEST(RecentBoardViews, ABoardThatIsGoneIsAskedFor) {
  RecentBoardViews recent;
  for (int i = 0; i < 5; ++i) recent.add(0, at(i), kWidth_px, board_at(100));
  for (int i = 5; i < 30; ++i) recent.add(0, at(i), kWidth_px, {});
  EXPECT_EQ(recent.advice(), "show the board to the cameras");
  EXPECT_TRUE(recent.now().empty());
}

TEST(RecentBoardViews, ABoardThatIsLostInFastMotionIsBlurred) {
  RecentBoardViews slow, fast;
  for (int i = 0; i < 16; ++i) {
    const bool lost = i % 4 > 1;
    slow.add(0, at(i), kWidth_px, lost ? BoardDetection{} : board_at(100 + 2 * i));
    fast.add(0, at(i), kWidth_px, lost ? BoardDetection{} : board_at(100 + 60 * (i % 4)));
  }
  EXPECT_EQ(slow.advice(), "");
  EXPECT_EQ(fast.advice(), "hold still: the images are blurred");
}

TEST(RecentBoardViews, WrongBoardsAreTold) {
  RecentBoardViews foreign, mirrored, twice;
  for (int i = 0; i < 10; ++i) {
    foreign.add(0, at(i), kWidth_px, {{}, 1, 5, 0});
    mirrored.add(0, at(i), kWidth_px, {}, i == 3);
    BoardDetection two = board_at(100);
    two.twice = 3;
    twice.add(0, at(i), kWidth_px, two);
  }
  EXPECT_NE(foreign.advice().find("target file"), std::string::npos);
  EXPECT_NE(mirrored.advice().find("mirrored"), std::string::npos);
  EXPECT_EQ(twice.advice(), "leave only one board in view");
}

}  // namespace recent_board_views_test
}  // namespace fbvins
