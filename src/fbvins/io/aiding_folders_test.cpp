// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/aiding_folders.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace fbvins {
namespace aiding_folders_test {

RangeSample beam() {
  RangeSample r;
  r.t = Time{1'000'000'000}, r.distance_m = 1.25;
  r.p_B = Vec3(0.1, -0.02, 0.03), r.direction_B = Vec3(0.6, 0, -0.8);
  r.sigma_m = 0.012, r.nearest_m = 0.05, r.farthest_m = 8;
  return r;
}

VelocitySample wheel() {
  VelocitySample v{.t = Time{1'000'000'000}, .v_mps = Vec3(0.8, -0.1, 0.02), .sigma_mps = Vec3(0.03, 0.1, kUnmeasured_mps)};
  v.p_B = Vec3(-0.2, 0, -0.4), v.q_BS = so3_exp(Vec3(0.1, 0.2, 2));
  return v;
}

Result<std::vector<AidingSample>> parsed(const std::string& kind, const std::string& yaml, const std::string& csv,
                                         std::vector<std::string>& warnings, const Pose<B, B>& T_BI = {}) {
  for (const AidingFolder& folder : aiding_folders())
    if (folder.name == kind)
      return folder.parse({YamlReader(kind + "0/sensor.yaml", yaml), csv, kind + "0/data.csv", T_BI}, warnings);
  return Error{ErrorCode::not_found, kind};
}

AidingText text_of(const std::vector<AidingSample>& readings) { return aiding_texts(readings, "a test").front(); }

TEST(AidingFolders, RangesAreReadAsTheyAreWritten) {
  RangeSample second = beam();
  second.t = Time{1'050'000'000}, second.distance_m = std::numeric_limits<double>::infinity();
  std::vector<std::string> warnings;
  const AidingText text = text_of({beam(), second});
  EXPECT_EQ(text.folder, "range0");
  const auto read = parsed("range", text.sensor_yaml, text.csv, warnings);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 2u);
  const auto& r = std::get<RangeSample>(read->front());
  EXPECT_EQ(r.t, beam().t);
  EXPECT_EQ(r.distance_m, 1.25);
  EXPECT_LT((r.p_B - beam().p_B).norm(), 1e-12);
  EXPECT_LT((r.direction_B - beam().direction_B).norm(), 1e-9);
  EXPECT_EQ(r.sigma_m, 0.012);
  EXPECT_EQ(r.nearest_m, 0.05);
  EXPECT_EQ(r.farthest_m, 8);
  EXPECT_GT(std::get<RangeSample>((*read)[1]).distance_m, r.farthest_m) << "it sees nothing";
  EXPECT_TRUE(warnings.empty());
}

TEST(AidingFolders, VelocitiesAndPressuresAreReadAsTheyAreWritten) {
  std::vector<std::string> warnings;
  const AidingText text = text_of({wheel()});
  EXPECT_EQ(text.folder, "velocity0");
  const auto read = parsed("velocity", text.sensor_yaml, text.csv, warnings);
  ASSERT_TRUE(read) << read.error().message;
  const auto& v = std::get<VelocitySample>(read->front());
  EXPECT_EQ(v.t, wheel().t);
  EXPECT_EQ(v.v_mps, wheel().v_mps);
  EXPECT_EQ(v.sigma_mps, wheel().sigma_mps);
  EXPECT_LT((v.p_B - wheel().p_B).norm(), 1e-12);
  EXPECT_LT(v.q_BS.angularDistance(wheel().q_BS), 1e-7);
  const AidingText air = text_of({PressureSample{Time{7}, 101'234.5, 3}});
  EXPECT_EQ(air.folder, "baro0");
  const auto pressures = parsed("baro", air.sensor_yaml, air.csv, warnings);
  ASSERT_TRUE(pressures) << pressures.error().message;
  EXPECT_EQ(std::get<PressureSample>(pressures->front()).pressure_pa, 101'234.5);
  EXPECT_EQ(std::get<PressureSample>(pressures->front()).sigma_pa, 3);
  EXPECT_TRUE(warnings.empty());
}

TEST(AidingFolders, VelocitiesWithoutStandardDeviationsHaveThoseOfTheSensor) {
  std::vector<std::string> warnings;
  const std::string yaml = text_of({wheel()}).sensor_yaml + "noise_mps: [0.2, 0.3, 100]\n";
  const auto read = parsed("velocity", yaml, "5,1,2,3\n6,1,2,4\n", warnings);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(std::get<VelocitySample>(read->front()).sigma_mps, Vec3(0.2, 0.3, 100));
}

TEST(AidingFolders, EachSensorHasAFolder) {
  RangeSample ahead = beam();
  ahead.direction_B = Vec3::UnitX();
  const auto texts = aiding_texts({beam(), ahead, wheel(), beam(), PressureSample{Time{7}, 1e5}}, "a test");
  ASSERT_EQ(texts.size(), 4u);
  EXPECT_EQ(texts[0].folder, "range0");
  EXPECT_EQ(texts[1].folder, "range1");
  EXPECT_EQ(texts[2].folder, "velocity0");
  EXPECT_EQ(texts[3].folder, "baro0");
}

TEST(AidingFolders, PlacesAreInTheFrameOfTheImu) {
  std::vector<std::string> warnings;
  const Pose<B, B> T_BI(so3_exp(Vec3(0, 0, 1)), Vec3(1, 0, 0));
  const AidingText text = text_of({beam()}), motion = text_of({wheel()});
  const auto read = parsed("range", text.sensor_yaml, text.csv, warnings, T_BI);
  const auto wheels = parsed("velocity", motion.sensor_yaml, motion.csv, warnings, T_BI);
  ASSERT_TRUE(read && wheels);
  EXPECT_LT((T_BI * std::get<RangeSample>(read->front()).p_B - beam().p_B).norm(), 1e-9);
  EXPECT_LT((T_BI.q * std::get<RangeSample>(read->front()).direction_B - beam().direction_B).norm(), 1e-9);
  EXPECT_LT((T_BI * std::get<VelocitySample>(wheels->front()).p_B - wheel().p_B).norm(), 1e-9);
}

TEST(AidingFolders, WrongFilesAreNamed) {
  const AidingText text = text_of({beam()});
  std::string negative = text.sensor_yaml;
  negative.insert(negative.find("noise_m: ") + 9, "-");
  struct Case {
    const char *kind, *says;
    std::string yaml, csv;
  };
  for (const Case& c :
       {Case{"range", "T_BS", "noise_m: 0.01\n", text.csv}, Case{"range", "noise_m", negative, text.csv},
        Case{"range", "data.csv:1", text.sensor_yaml, "1,2,3\n"}, Case{"velocity", "T_BS", "noise_mps: [1, 1, 1]\n", "1,2,3,4\n"},
        Case{"velocity", "noise_mps", text.sensor_yaml + "noise_mps: [0.1, 0, 0.1]\n", "1,2,3,4\n"},
        Case{"velocity", "noise_mps", text.sensor_yaml + "noise_mps: [0.1]\n", "1,2,3,4\n"},
        Case{"velocity", "4 or 7", text.sensor_yaml, "1,2,3\n"}, Case{"baro", "noise_pa", "noise_pa: 0\n", "1,100000\n"},
        Case{"baro", "data.csv:1", "noise_pa: 1\n", "1,2,3\n"}}) {
    std::vector<std::string> warnings;
    const auto read = parsed(c.kind, c.yaml, c.csv, warnings);
    ASSERT_FALSE(read) << c.kind << " " << c.says;
    EXPECT_NE(read.error().message.find(c.says), std::string::npos) << read.error().message;
  }
}

TEST(AidingFolders, BadRowsAreLeftOutAndSaid) {
  std::vector<std::string> warnings;
  const auto read = parsed("range", text_of({beam()}).sensor_yaml, "1000,1.0\n2000,nan\n3000,1.2\n4000,1.3\n", warnings);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->size(), 3u);
  EXPECT_EQ(warnings.size(), 1u);
  const auto air = parsed("baro", "noise_pa: 2\n", "1,100000\n2,0\n3,100001\n", warnings);
  ASSERT_TRUE(air) << air.error().message;
  EXPECT_EQ(air->size(), 2u) << "no air has no pressure";
  EXPECT_EQ(warnings.size(), 2u);
}

}  // namespace aiding_folders_test
}  // namespace fbvins
