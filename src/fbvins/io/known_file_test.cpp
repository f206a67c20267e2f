// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/known_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace fbvins {
namespace known_file_test {

std::string what(const std::string& name, const std::string& content) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "fbvins_known";
  std::filesystem::create_directories(folder);
  const std::string path = (folder / name).string();
  std::ofstream(path, std::ios::binary) << content;
  const auto known = known_file(path);
  std::filesystem::remove_all(folder);
  if (known) {
    EXPECT_FALSE(known->use.empty());
  }
  return known ? known->what : "";
}

TEST(KnownFiles, ByTheirFirstBytes) {
  EXPECT_EQ(what("flat.fbm", "FBVPLACE...."), "a map");
  EXPECT_EQ(what("words", "FBVWORDS...."), "a vocabulary of visual words");
  EXPECT_EQ(what("log.ulg", std::string("ULog\x01\x12\x35\x01", 8)), "a log of PX4");
  EXPECT_EQ(what("0001.png", "\x89PNG\r\n"), "an image");
  EXPECT_EQ(what("flight.mp4", std::string("\0\0\0 ftypisom....", 16)), "a film (MP4)");
  EXPECT_EQ(what("flight.tar.gz", "\x1F\x8B\x08"), "an archive (gzip)");
  EXPECT_EQ(what("nothing", ""), "an empty file");
}

TEST(KnownFiles, ByTheirWords) {
  EXPECT_EQ(what("imu.yaml", "gyroscope_noise_density: 0.001\n"), "the noise of an IMU (Kalibr's imu.yaml)");
  EXPECT_EQ(what("board.yaml", "target_type: 'aprilgrid'\n"), "a board");
  EXPECT_EQ(what("a.yaml", "estimator:\n  max_iterations: 5\n"), "a configuration of this program");
  EXPECT_EQ(what("summary.json", "{\"result\": {}, \"timing\": {}}"), "the summary of a run");
}

TEST(KnownFiles, ByTheirRows) {
  EXPECT_EQ(what("a.txt", "1.5 1 2 3 0 0 0 1\n3.5 1 2 3 0 0 0 1\n"), "2 poses, a trajectory over 2.0 s");
  EXPECT_EQ(what("a.csv", "1403636579763555584,0.1,0.2,0.3,8,0,-3\n1403636579768555584,0.1,0.2,0.3,8,0,-3\n"),
            "2 readings of an IMU, as in EuRoC's imu0/data.csv, over 0.0 s");
  EXPECT_EQ(what("a.csv", "1403636579763555584,1403636579763555584.png\n1403636580763555584,b.png\n"),
            "2 images, listed as EuRoC's camN/data.csv does, over 1.0 s");
  EXPECT_EQ(what("00.txt", "1 0 0 5 0 1 0 6 0 0 1 7\n"), "KITTI's poses, without times");
  EXPECT_EQ(what("letter.txt", "Dear all,\nno numbers here\n"), "");
  EXPECT_EQ(what("bytes", std::string("a\0b\n1,2,3\n", 10)), "");
}

}  // namespace known_file_test
}  // namespace fbvins
