// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/detections_file.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace detections_file_test {

constexpr const char* kHeader = "timestamp_ns,camera,corner,u_px,v_px\n";

std::string complaint(const std::string& rows) {
  const auto read = parse_detections(kHeader + rows, "d.csv");
  return read ? "read" : read.error().message;
}

TEST(DetectionsFile, RowsInAnyOrderBecomeViews) {
  const auto read =
      parse_detections(std::string("# camera 1: 640 x 400\n") + kHeader +
                           "2000000000,0,5,1.5,2.5\n1000000000,1,3,7,8\n2000000000,0,4,-0.25,9\n1000000000,0,3,1,2\n",
                       "d.csv");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->views.size(), 3u);
  EXPECT_EQ(read->views[0].camera, 0);
  EXPECT_EQ(read->views[1].camera, 1);
  EXPECT_EQ(read->views[2].t.ns, 2000000000);
  ASSERT_EQ(read->views[2].corners.size(), 2u);
  EXPECT_EQ(read->views[2].corners[0].index, 4);
  EXPECT_EQ(read->views[2].corners[0].pixel, Vec2(-0.25, 9));
  EXPECT_EQ(read->camera_count(), 2);
  EXPECT_EQ(read->sizes.at(1), (ImageSize{640, 400}));
  EXPECT_FALSE(read->sizes.contains(0));
}

TEST(DetectionsFile, WhatIsWrittenIsReadBack) {
  Detections detections;
  detections.sizes[0] = {752, 480};
  detections.views = {{Time{5}, 0, {{0, {1.25, 2.5}}, {7, {3.0625, 470.125}}}}, {Time{5}, 1, {{1, {9, 9}}}}};
  const std::string text = detections_to_csv(detections);
  const auto read = parse_detections(text, "d.csv");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(detections_to_csv(*read), text);
  EXPECT_EQ(read->sizes, detections.sizes);
  detections.sizes[2] = {640, 480};
  EXPECT_EQ(detections.camera_count(), 3) << "a camera that never sees the board";
  EXPECT_EQ(read->views[0].corners[1].pixel, Vec2(3.0625, 470.125));
}

TEST(DetectionsFile, ComplaintsNameFileLineAndField) {
  EXPECT_EQ(complaint("1,0,3,7\n"), "d.csv:2: has 4 fields, not the five of timestamp_ns,camera,corner,u_px,v_px");
  EXPECT_EQ(complaint("1,0,3,7,8\n1.5,0,3,7,8\n"), "d.csv:3: timestamp_ns: '1.5' is no stamp in nanoseconds");
  EXPECT_EQ(complaint("1,8,3,7,8\n"), "d.csv:2: camera: '8' is not a whole number from 0 to 7");
  EXPECT_EQ(complaint("1,0,-3,7,8\n"), "d.csv:2: corner: '-3' is not the number of a corner");
  EXPECT_EQ(complaint("1,0,3,nan,8\n"), "d.csv:2: u_px: 'nan' is no position in an image");
  EXPECT_EQ(complaint("1,0,3,7,1e9\n"), "d.csv:2: v_px: '1e9' is no position in an image");
  EXPECT_EQ(complaint(""), "d.csv: holds no corners");
  EXPECT_NE(complaint("1,0,3,7,8\n1,0,3,70,80\n").find("corner 3 is there twice in the image of camera 0"), std::string::npos);
}

}  // namespace detections_file_test
}  // namespace fbvins
