// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/web_messages.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

namespace fbvins {
namespace web_messages_test {

using Json = nlohmann::json;

template <class Number>
Number number_at(const std::string& bytes, std::size_t at) {
  Number number;
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

TEST(StateMessage, HasAPoseOnlyWhereThereIsOne) {
  FlightHistory history;
  Odometry o;
  o.id = FrameId{5};
  o.T_WB.p = Vec3(1.23456, -2, 3);
  o.pose_covariance(0, 0) = 0.01;
  EXPECT_FALSE(Json::parse(state_message(0, o, nullptr, history)->bytes).contains("position_m"));
  o.health = {HealthState::degraded, HealthReason::few_tracks};
  const Json json = Json::parse(state_message(0.5, o, nullptr, history)->bytes);
  EXPECT_EQ(json["position_m"], Json({1.2346, -2.0, 3.0}));
  EXPECT_DOUBLE_EQ(json["sigma_m"], 0.1);
  EXPECT_EQ(json["reason"], "few_tracks");
  EXPECT_EQ(json["image"], 5);
  EXPECT_FALSE(json.contains("latency_ms"));
}

TEST(StateMessage, IsJsonWhateverTheNumbers) {
  FlightHistory history;
  Odometry o;
  o.health.state = HealthState::good;
  o.T_WB.p = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  o.pose_covariance(0, 0) = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(Json::parse(state_message(0, o, nullptr, history)->bytes)["position_m"][0].is_null());
}

TEST(ImageMessage, CarriesItsFeaturesBeforeTheJpeg) {
  const SharedMessage message = image_message(1.5, "JPEG", 752, 480, {{TrackId{7}, Vec2(10, 20), 3, 4.5}});
  const std::string& bytes = message->bytes;
  ASSERT_EQ(bytes.size(), 24u + 16 + 4);
  EXPECT_TRUE(message->binary && message->image);
  EXPECT_EQ(bytes[0], 1);
  EXPECT_EQ(number_at<std::uint16_t>(bytes, 2), 0u);
  EXPECT_EQ(number_at<std::uint16_t>(image_message(1.5, "JPEG", 752, 480, {}, 3)->bytes, 2), 3u) << "of camera 3";
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 4), 1u);
  EXPECT_EQ(number_at<double>(bytes, 8), 1.5);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 16), 752u);
  EXPECT_EQ(number_at<float>(bytes, 36), 4.5f);
  EXPECT_EQ(bytes.substr(40), "JPEG");
}

TEST(PointsMessage, CarriesTracksAndPlaces) {
  const std::string bytes = points_message(2, {{TrackId{9}, Vec3(1, 2, 3)}}, true)->bytes;
  ASSERT_EQ(bytes.size(), 24u + 16);
  EXPECT_EQ(bytes[0], 3);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, 24), 9u);
  EXPECT_EQ(number_at<float>(bytes, 36), 3.f);
}

TEST(HelloMessage, QuotesWhatPeopleWrote) {
  WebFlight flight{.source = "a \"quoted\"\n<b>name</b>\xff"};
  flight.commands = {{"save_map", "no map"}, {"reset", ""}};
  const Json json = Json::parse(hello_message(flight, Time{1'234'567'890'123'456'789})->bytes);
  EXPECT_EQ(json["start_ns"], "1234567890123456789");
  EXPECT_EQ(json["commands"]["save_map"], "no map");
  EXPECT_EQ(json["commands"]["reset"], "") << "it can be done";
  EXPECT_FALSE(json.contains("vehicle_to_imu_wxyz")) << "how the IMU is mounted is not known";
  flight.q_B_vehicle = Quat(0, 1, 0, 0);
  EXPECT_EQ(Json::parse(hello_message(flight, Time{1})->bytes)["vehicle_to_imu_wxyz"], Json({0.0, 1.0, 0.0, 0.0}));
}

TEST(Command, IsParsedOrIgnored) {
  EXPECT_EQ(parse_command(R"({"do":"mark","text":"here"})")->text, "here");
  EXPECT_EQ(parse_command(R"({"do":"mark","text":")" + std::string(500, 'x') + "\"}")->text.size(), 120u);
  EXPECT_EQ(parse_command(R"({"do":"save_map"})")->kind, WebCommand::Kind::flight);
  EXPECT_EQ(parse_command(R"({"do":"save_map"})")->text, "save_map");
  EXPECT_FALSE(parse_command(R"({"do":")" + std::string(500, 'x') + "\"}"));
  EXPECT_EQ(parse_command(R"({"do":"seek","t_s":3.5})")->t_s, 3.5);
  for (const char* wrong : {"", "[]", "{}", "mark", R"({"do":1})", R"({"do":"seek"})", R"({"do":"seek","t_s":"x"})", "\xff\xfe"})
    EXPECT_FALSE(parse_command(wrong)) << wrong;
}

}  // namespace web_messages_test
}  // namespace fbvins
