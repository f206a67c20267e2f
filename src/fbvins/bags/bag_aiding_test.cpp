// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_aiding.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "fbvins/bags/recording.hpp"
#include "fbvins/bags/ros1_bag_writer.hpp"
#include "fbvins/bags/topic_choice.hpp"

namespace fbvins {
namespace bag_aiding_test {

constexpr Time kT{1'000'000'000};

/// A pair, an IMU in the frame "imu", a beam in the frame "laser" and a barometer.
BagContents contents() {
  BagContents out;
  for (const char* camera : {"/left/image", "/right/image"}) out.images[camera].rows = {{kT, "0+0+0"}};
  out.imu["/imu"].samples = {ImuSample{kT}}, out.imu["/imu"].frame = "imu";
  out.aiding["/laser"].readings = {RangeSample{.t = kT, .distance_m = 2}}, out.aiding["/laser"].frame = "laser";
  out.aiding["/baro"].readings = {PressureSample{kT, 1e5}}, out.aiding["/baro"].frame = "anywhere";
  return out;
}

TEST(BagAiding, IsUsedOnlyWhereItIsNamed) {
  BagContents bag = contents();
  const auto unnamed = choose_topics(bag, {}, {});
  ASSERT_TRUE(unnamed);
  EXPECT_TRUE(unnamed->aiding.empty());
  DatasetContents out;
  ASSERT_TRUE(read_aiding(bag, *unnamed, out));
  EXPECT_TRUE(out.aiding.empty());
  ASSERT_EQ(out.info.warnings.size(), 2u);
  EXPECT_NE(out.info.warnings[1].find("/laser"), std::string::npos);
  const auto named = choose_topics(bag, {"/baro"}, {});
  ASSERT_TRUE(named);
  EXPECT_EQ(named->cameras.size(), 2u) << "which are found";
  DatasetContents with;
  ASSERT_TRUE(read_aiding(bag, *named, with));
  ASSERT_EQ(with.aiding.size(), 1u);
  EXPECT_EQ(std::get<PressureSample>(with.aiding[0]).pressure_pa, 1e5);
}

TEST(BagAiding, ItsPlaceIsThatOfItsFrame) {
  BagContents bag = contents();
  const auto chosen = choose_topics(bag, {"/laser"}, {});
  ASSERT_TRUE(chosen);
  DatasetContents out;
  const auto lost = read_aiding(bag, *chosen, out);
  ASSERT_FALSE(lost);
  EXPECT_NE(lost.error().message.find("/tf_static"), std::string::npos) << lost.error().message;
  bag.transforms = {{"base", "imu", Quat::Identity(), Vec3(0, 0, 0.1)},
                    {"base", "laser", so3_exp(Vec3(0, std::acos(0.0), 0)), Vec3(0.2, 0, 0)}};
  ASSERT_TRUE(read_aiding(bag, *chosen, out));
  const auto& beam = std::get<RangeSample>(out.aiding.at(0));
  EXPECT_LT((beam.p_B - Vec3(0.2, 0, -0.1)).norm(), 1e-12);
  EXPECT_LT((beam.direction_B + Vec3::UnitZ()).norm(), 1e-12);
}

TEST(BagAiding, UnknownTopicsAreAnsweredWithThoseThereAre) {
  const auto chosen = choose_topics(contents(), {"/sonar"}, {});
  ASSERT_FALSE(chosen);
  EXPECT_NE(chosen.error().message.find("of other sensors on /baro, /laser"), std::string::npos) << chosen.error().message;
}

TEST(BagAiding, OurOwnBagsKeepIt) {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{90, 91, 40, 30, 0, 0, 0, 0}, 80, 60), {}});
  rig.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
  rig.time_offset_s = 0.02;
  const std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / ("aiding_" + std::to_string(getpid()) + ".bag");
  auto bag = Ros1BagWriter::create(file.string(), rig, kT);
  ASSERT_TRUE(bag) << bag.error().message;
  const auto image = std::make_shared<const Image>(80, 60);
  VelocitySample wheel{.t = kT, .v_mps = Vec3(1, 2, 3), .sigma_mps = Vec3(0.1, 0.2, 0.3), .p_B = Vec3(0, 0, -0.3)};
  wheel.q_BS = so3_exp(Vec3(0.1, 0.2, 0.3));
  for (int i = 0; i < 60; ++i) {
    const Time t{kT.ns + 5'000'000 * static_cast<std::int64_t>(i)};
    ASSERT_TRUE(bag->add(ImuSample{t, Vec3::Zero(), Vec3(0, 0, 9.81)}));
    if (i % 10 != 5) continue;
    wheel.t = t;
    ASSERT_TRUE(bag->add(AidingSample(RangeSample{.t = t, .distance_m = 1.5, .p_B = Vec3(0.1, 0, 0)})));
    ASSERT_TRUE(bag->add(AidingSample(wheel)));
    ASSERT_TRUE(bag->add(AidingSample(PressureSample{t, 1e5, 2})));
    ASSERT_TRUE(bag->add(StereoFrame{t, {image, image}}));
  }
  ASSERT_TRUE(bag->finish());
  auto data = open_recording(file.string());
  ASSERT_TRUE(data) << data.error().message;
  std::vector<AidingSample> back;
  while (auto event = (*data)->next())
    if (const auto* r = std::get_if<AidingSample>(&*event)) back.push_back(*r);
  std::filesystem::remove(file);
  ASSERT_EQ(back.size(), 18u);
  EXPECT_EQ(stamp_of(back[0]), Time{kT.ns + 25'000'000});
  const auto range = readings_of<RangeSample>(back).front();
  EXPECT_LT((range.p_B - Vec3(0.1, 0, 0)).norm() + (range.direction_B + Vec3::UnitZ()).norm(), 1e-12);
  const auto velocity = readings_of<VelocitySample>(back).front();
  EXPECT_EQ(velocity.v_mps, Vec3(1, 2, 3));
  EXPECT_LT((velocity.sigma_mps - Vec3(0.1, 0.2, 0.3)).norm(), 1e-12);
  EXPECT_LT(velocity.q_BS.angularDistance(wheel.q_BS), 1e-9);
}

}  // namespace bag_aiding_test
}  // namespace fbvins
