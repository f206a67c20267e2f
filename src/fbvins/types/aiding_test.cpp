// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/sensor_event.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace fbvins {
namespace aiding_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Aiding, WhatASensorCannotHaveMeasuredIsImpossible) {
  EXPECT_EQ(impossible(AidingSample(VelocitySample{})), "");
  EXPECT_EQ(impossible(AidingSample(PressureSample{.t = {}, .pressure_pa = 101'325})), "");
  VelocitySample v;
  v.v_mps.y() = kNan;
  EXPECT_NE(impossible(v), "");
  v = {}, v.sigma_mps.x() = 0;
  EXPECT_NE(impossible(v), "");
  v = {}, v.q_BS = Quat(1, 1, 0, 0);
  EXPECT_NE(impossible(v), "");
  for (const double pressure : {kNan, 0.0, 1013.25, 1e6}) EXPECT_NE(impossible(PressureSample{{}, pressure}), "") << pressure;
  EXPECT_NE(impossible(PressureSample{{}, 1e5, kNan}), "");
}

TEST(Aiding, AnyEventHasItsStamp) {
  for (SensorEvent event : {SensorEvent(ImuSample{Time{7}}), SensorEvent(StereoFrame{Time{7}}),
                            SensorEvent(RangeSample{.t = Time{7}}), SensorEvent(VelocitySample{.t = Time{7}})}) {
    EXPECT_EQ(stamp_of(std::as_const(event)), Time{7});
    stamp_of(event) = Time{9};
    EXPECT_EQ(stamp_of(std::as_const(event)), Time{9});
  }
}

TEST(Aiding, ReadingsOfOneSensorKeepTheirOrder) {
  const std::vector<AidingSample> all = {PressureSample{Time{1}, 1e5}, VelocitySample{Time{2}}, PressureSample{Time{3}, 1e5}};
  const auto pressures = readings_of<PressureSample>(all);
  ASSERT_EQ(pressures.size(), 2u);
  EXPECT_EQ(pressures[1].t, Time{3});
  EXPECT_TRUE(readings_of<RangeSample>(all).empty());
}

}  // namespace aiding_test
}  // namespace fbvins
