// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/aiding_messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace fbvins {
namespace aiding_messages_test {

constexpr Time kT{1'700'000'000'123'456'789};

std::vector<AidingSample> readings() {
  VelocitySample v{.t = kT, .v_mps = Vec3(0.8, -0.1, 0.02), .sigma_mps = Vec3(0.03, 0.1, kUnmeasured_mps)};
  return {RangeSample{.t = kT, .distance_m = 1.25, .sigma_m = 0.5, .nearest_m = 0.5, .farthest_m = 8}, v,
          PressureSample{kT, 101'234.5, 3}};
}

std::optional<AidingMessage> back(const AidingSample& reading, Encoding encoding) {
  return aiding_of(aiding_message(reading, "a frame", encoding), encoding, aiding_type(reading));
}

TEST(AidingMessages, AreReadAsTheyAreWrittenInBothEncodings) {
  for (const Encoding encoding : {Encoding::ros1, Encoding::cdr})
    for (const AidingSample& reading : readings()) {
      const auto read = back(reading, encoding);
      ASSERT_TRUE(read) << aiding_name(reading);
      EXPECT_EQ(read->frame, "a frame");
      ASSERT_EQ(read->reading.index(), reading.index());
      EXPECT_EQ(stamp_of(read->reading), kT);
    }
  const auto range = std::get<RangeSample>(back(readings()[0], Encoding::cdr)->reading);
  EXPECT_EQ(range.distance_m, 1.25);
  EXPECT_EQ(range.nearest_m, 0.5);
  EXPECT_EQ(range.farthest_m, 8);
  EXPECT_EQ(range.sigma_m, 0.5);
  EXPECT_EQ(std::get<RangeSample>(back(readings()[0], Encoding::ros1)->reading).sigma_m, RangeSample{}.sigma_m)
      << "ROS 1 has no variance of a range";
  const auto velocity = std::get<VelocitySample>(back(readings()[1], Encoding::ros1)->reading);
  EXPECT_EQ(velocity.v_mps, Vec3(0.8, -0.1, 0.02));
  EXPECT_LT((velocity.sigma_mps - Vec3(0.03, 0.1, kUnmeasured_mps)).norm(), 1e-12);
  const auto pressure = std::get<PressureSample>(back(readings()[2], Encoding::cdr)->reading);
  EXPECT_EQ(pressure.pressure_pa, 101'234.5);
  EXPECT_NEAR(pressure.sigma_pa, 3, 1e-12);
}

TEST(AidingMessages, UnknownVariancesAreTheDefaults) {
  VelocitySample v{.t = kT};
  v.sigma_mps.setZero();
  EXPECT_EQ(std::get<VelocitySample>(back(v, Encoding::ros1)->reading).sigma_mps, Vec3::Constant(0.1));
  EXPECT_EQ(std::get<PressureSample>(back(PressureSample{kT, 1e5, 0}, Encoding::cdr)->reading).sigma_pa,
            PressureSample{}.sigma_pa);
}

TEST(AidingMessages, ASensorThatSeesNothingIsRead) {
  for (const double nothing : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    RangeSample r{.t = kT, .distance_m = nothing};
    EXPECT_TRUE(std::isinf(std::get<RangeSample>(back(r, Encoding::cdr)->reading).distance_m));
  }
}

TEST(AidingMessages, CutAndImpossibleOnesAreNone) {
  for (const Encoding encoding : {Encoding::ros1, Encoding::cdr})
    for (const AidingSample& reading : readings()) {
      const std::string whole = aiding_message(reading, "a frame", encoding);
      const std::size_t needed = whole.size() - (reading.index() == 0 && encoding == Encoding::cdr ? 4 : 0);  // the variance
      for (std::size_t size = 0; size < needed; ++size)
        EXPECT_FALSE(aiding_of(std::string_view(whole).substr(0, size), encoding, aiding_type(reading))) << size;
    }
  EXPECT_FALSE(back(PressureSample{kT, 1013.25, 1}, Encoding::ros1)) << "hectopascals";
}

TEST(AidingMessages, APlaceIsKeptByTheFrame) {
  for (AidingSample reading : readings()) {
    const Pose<B, B> T_BS(so3_exp(Vec3(0.1, 0.2, 2)), Vec3(1, 2, 3));
    const auto T = mounting_of(mounted(reading, T_BS));
    if (!T) continue;
    EXPECT_LT((T->p - T_BS.p).norm(), 1e-12);
    EXPECT_LT((T->q * Vec3::UnitX() - T_BS.q * Vec3::UnitX()).norm(), 1e-9);
  }
}

TEST(AidingMessages, OwnTopicsAreKnown) {
  for (const char* own : {"/range0", "/velocity12", "/baro3"}) EXPECT_TRUE(is_own_aiding_topic(own)) << own;
  for (const char* other : {"/range", "/range0/raw", "/mavros/distance", "range0", "/barometer0"})
    EXPECT_FALSE(is_own_aiding_topic(other)) << other;
}

TEST(AidingSensors, EachPlaceIsASensor) {
  AidingSensors sensors;
  RangeSample down, ahead;
  ahead.direction_B = Vec3::UnitX();
  EXPECT_EQ(sensors.add(down, 4).name, "range0");
  EXPECT_EQ(sensors.find(ahead), nullptr);
  EXPECT_EQ(sensors.add(ahead, 5).name, "range1");
  EXPECT_EQ(sensors.find(down)->topic, 4u);
  EXPECT_EQ(sensors.add(PressureSample{}, 6).name, "baro0");
}

}  // namespace aiding_messages_test
}  // namespace fbvins
