// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/range_folder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace fbvins {
namespace range_folder_test {

RangeSample beam() {
  RangeSample r;
  r.t = Time{1'000'000'000}, r.distance_m = 1.25;
  r.p_B = Vec3(0.1, -0.02, 0.03), r.direction_B = Vec3(0.6, 0, -0.8);
  r.sigma_m = 0.012, r.nearest_m = 0.05, r.farthest_m = 8;
  return r;
}

Result<std::vector<RangeSample>> parsed(const std::string& yaml, const std::string& csv, std::vector<std::string>& warnings,
                                        const Pose<B, B>& T_BI = {}) {
  return parse_ranges(YamlReader("range0/sensor.yaml", yaml), csv, "range0/data.csv", T_BI, warnings);
}

TEST(RangeFolder, IsReadAsItIsWritten) {
  RangeSample second = beam();
  second.t = Time{1'050'000'000}, second.distance_m = std::numeric_limits<double>::infinity();
  std::vector<std::string> warnings;
  const auto read = parsed(range_yaml(beam(), "a test"), range_csv({beam(), second}), warnings);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 2u);
  const RangeSample& r = read->front();
  EXPECT_EQ(r.t, beam().t);
  EXPECT_EQ(r.distance_m, 1.25);
  EXPECT_LT((r.p_B - beam().p_B).norm(), 1e-12);
  EXPECT_LT((r.direction_B - beam().direction_B).norm(), 1e-9);
  EXPECT_EQ(r.sigma_m, 0.012);
  EXPECT_EQ(r.nearest_m, 0.05);
  EXPECT_EQ(r.farthest_m, 8);
  EXPECT_GT((*read)[1].distance_m, r.farthest_m) << "it sees nothing";
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(impossible(r), "");
}

TEST(RangeFolder, TheBeamIsInTheFrameOfTheImu) {
  std::vector<std::string> warnings;
  const Pose<B, B> T_BI(so3_exp(Vec3(0, 0, 1)), Vec3(1, 0, 0));
  const auto read = parsed(range_yaml(beam(), "a test"), range_csv({beam()}), warnings, T_BI);
  ASSERT_TRUE(read);
  EXPECT_LT((T_BI * read->front().p_B - beam().p_B).norm(), 1e-9);
  EXPECT_LT((T_BI.q * read->front().direction_B - beam().direction_B).norm(), 1e-9);
}

TEST(RangeFolder, WrongFilesAreNamed) {
  std::vector<std::string> warnings;
  const auto without_place = parsed("noise_m: 0.01\n", range_csv({beam()}), warnings);
  ASSERT_FALSE(without_place);
  EXPECT_NE(without_place.error().message.find("T_BS"), std::string::npos) << without_place.error().message;
  std::string negative = range_yaml(beam(), "a");
  negative.insert(negative.find("noise_m: ") + 9, "-");
  const auto no_noise = parsed(negative, range_csv({beam()}), warnings);
  ASSERT_FALSE(no_noise);
  EXPECT_NE(no_noise.error().message.find("noise_m"), std::string::npos) << no_noise.error().message;
  const auto three_columns = parsed(range_yaml(beam(), "a"), "1,2,3\n", warnings);
  ASSERT_FALSE(three_columns);
  EXPECT_NE(three_columns.error().message.find("data.csv:1"), std::string::npos) << three_columns.error().message;
}

TEST(RangeFolder, ABadRowIsLeftOutAndSaid) {
  std::vector<std::string> warnings;
  const auto read = parsed(range_yaml(beam(), "a"), "1000,1.0\n2000,nan\n3000,1.2\n4000,1.3\n", warnings);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->size(), 3u);
  EXPECT_EQ(warnings.size(), 1u);
}

}  // namespace range_folder_test
}  // namespace fbvins
