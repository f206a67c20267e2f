// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mavlink/px4_parameters.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "fbvins/mavlink/messages.hpp"

namespace fbvins {
namespace px4_parameters_test {

std::map<std::string, double> as_wanted(const Px4VisionSetup& setup) {
  std::map<std::string, double> values;
  for (const Px4Parameter& p : px4_parameters(setup)) values[p.name] = p.value;
  return values;
}

TEST(Px4Parameters, AVehicleThatHasTheFileLoadedIsRight) {
  for (const Px4VisionSetup& setup : {Px4VisionSetup{},
                                      {.gps = true, .compass = true, .barometer = false},
                                      {.link = Px4Link::serial, .system_id = 7},
                                      {.link = Px4Link::ethernet}})
    EXPECT_TRUE(judge_px4(setup, as_wanted(setup)).empty());
}

TEST(Px4Parameters, WhatIsWrongIsOneSentenceWithTheReason) {
  auto values = as_wanted({});
  values["SYS_HAS_MAG"] = 1;
  values["EKF2_DELAY_MAX"] = 110;
  values["EKF2_EVA_NOISE"] = 0.02;  // smaller is fine
  values.erase("EKF2_EV_QMIN");
  values["EKF2_IMU_POS_X"] = 0.1;
  const auto found = judge_px4({}, values);
  ASSERT_EQ(found.size(), 4u);
  EXPECT_EQ(
      found[0].sentence,
      "SYS_HAS_MAG is 1, and should be 0: else PX4 waits for a compass before it arms: \"Found 0 compass\" (restart the flight controller after the change)");
  EXPECT_NE(found[1].sentence.find("EKF2_EV_QMIN is not answered"), std::string::npos);
  EXPECT_NE(found[2].sentence.find("EKF2_DELAY_MAX is 110, and should be at least 200"), std::string::npos);
  EXPECT_FALSE(found[3].wrong);
  EXPECT_NE(found[3].sentence.find("live.mavlink.mounting counts from the vehicle's origin"), std::string::npos);
}

TEST(Px4Parameters, ThereIsAHeightWhenVisionFails) {
  EXPECT_EQ(as_wanted({})["EKF2_HGT_REF"], 3) << "vision's, while there is vision";
  EXPECT_EQ(as_wanted({})["EKF2_BARO_CTRL"], 1);
  EXPECT_EQ(as_wanted({.barometer = false})["EKF2_BARO_CTRL"], 0);
}

TEST(Px4Parameters, BlindFlightEndsAfterASecondWhereThereIsNothingBesideVision) {
  EXPECT_EQ(as_wanted({})["EKF2_NOAID_TOUT"], 1000000);
  EXPECT_FALSE(as_wanted({.gps = true}).contains("EKF2_NOAID_TOUT"));
  auto values = as_wanted({});
  values["EKF2_NOAID_TOUT"] = 5000000;
  const auto found = judge_px4({}, values);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].sentence.find("should be at most 1000000"), std::string::npos) << found[0].sentence;
  values["EKF2_NOAID_TOUT"] = 500000;
  EXPECT_TRUE(judge_px4({}, values).empty());
}

TEST(Px4Parameters, TwoProgramsOnOnePortAreNamed) {
  const Px4VisionSetup serial{.link = Px4Link::serial};
  auto values = as_wanted(serial);
  values["UXRCE_DDS_CFG"] = 102;
  const auto found = judge_px4(serial, values);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].wrong);
  EXPECT_NE(found[0].sentence.find("uXRCE-DDS has TELEM 2, too"), std::string::npos);
  values["UXRCE_DDS_CFG"] = 101;
  EXPECT_TRUE(judge_px4(serial, values).empty());
  EXPECT_EQ(std::ranges::count(px4_parameter_names(serial), "UXRCE_DDS_CFG"), 1);
  EXPECT_EQ(std::ranges::count(px4_parameter_names({}), "UXRCE_DDS_CFG"), 0);
}

TEST(Px4Parameters, TheFileHasARowForEach) {
  const std::string text = px4_parameter_file({.link = Px4Link::serial, .system_id = 3});
  EXPECT_NE(text.find("3\t1\tEKF2_EV_CTRL\t15\t6\n"), std::string::npos);
  EXPECT_NE(text.find("3\t1\tEKF2_EVA_NOISE\t0.050000\t9\n"), std::string::npos);
  EXPECT_NE(text.find("3\t1\tMAV_SYS_ID\t3\t6\n"), std::string::npos);
  EXPECT_NE(text.find("SER_TEL2_BAUD\t921600"), std::string::npos);
  EXPECT_EQ(px4_parameter_file({}).find("SER_TEL2_BAUD"), std::string::npos);
}

TEST(Px4Parameters, AWholeNumberIsInTheBytesOfTheFloat) {
  ParameterValueMessage message;
  message.param_type = ParameterValueMessage::kInt32;
  message.param_value = std::bit_cast<float>(std::int32_t{921600});
  EXPECT_EQ(message.value(), 921600);
  message.param_type = ParameterValueMessage::kReal32;
  message.param_value = 0.5f;
  EXPECT_EQ(message.value(), 0.5);
  EXPECT_EQ(text_of(parameter_name("SIXTEEN_LETTERS_")), "SIXTEEN_LETTERS_");
  EXPECT_EQ(text_of(parameter_name("SHORT")), "SHORT");
}

}  // namespace px4_parameters_test
}  // namespace fbvins
