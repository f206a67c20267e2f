// SPDX-License-Identifier: Apache-2.0
#include "fbvins/tuning/ulog.hpp"

#include <gtest/gtest.h>

#include <cstdint>

#include "fbvins/io/little_endian.hpp"

namespace fbvins {
namespace ulog_test {

std::string message(char type, const std::string& body) {
  std::string out;
  append_le(out, static_cast<std::uint16_t>(body.size()));
  return out + type + body;
}

std::string subscription(std::uint8_t instance, std::uint16_t number, const std::string& topic) {
  std::string body;
  append_le(body, instance), append_le(body, number);
  return message('A', body + topic);
}

std::string data(std::uint16_t number, std::uint64_t t_us, float x, float y, std::int16_t z) {
  std::string body;
  append_le(body, number), append_le(body, t_us), append_le(body, x), append_le(body, y), append_le(body, z);
  return message('D', body);
}

std::string parameter(const std::string& key, float value) {
  std::string body(1, static_cast<char>(key.size()));
  body += key;
  append_le(body, value);
  return message('P', body);
}

std::string log() {
  std::string out("ULog\x01\x12\x35\x01", 8);
  append_le(out, std::uint64_t{0});
  out += message('B', std::string(40, '\0'));
  out += message('F', "torque:uint64_t timestamp;float[2] xyz;int16_t z;");
  out += parameter("float MC_ROLL_P", 6.5F);
  out += subscription(0, 7, "torque") + subscription(1, 8, "torque");
  out += data(7, 1'500'000, 1, 2, -3) + data(8, 1'600'000, 9, 9, 9) + message('S', "??") + data(7, 2'500'000, 4, 5, 6);
  return out;
}

TEST(Ulog, NumbersStampsAndParametersByName) {
  const Result<Ulog> ulog = Ulog::parse(log(), "a.ulg");
  ASSERT_TRUE(ulog) << ulog.error().message;
  EXPECT_EQ(ulog->seconds("torque"), (std::vector{1.5, 2.5})) << "only the first instance counts";
  EXPECT_EQ(ulog->numbers("torque", "xyz[1]"), (std::vector{2.0, 5.0}));
  EXPECT_EQ(ulog->numbers("torque", "z"), (std::vector{-3.0, 6.0}));
  EXPECT_TRUE(ulog->numbers("torque", "w").empty());
  EXPECT_TRUE(ulog->numbers("rates", "xyz[0]").empty());
  EXPECT_EQ(ulog->parameter("MC_ROLL_P"), 6.5);
  EXPECT_FALSE(ulog->parameter("MC_YAW_P"));
}

TEST(Ulog, ATruncatedLogIsReadUpToItsEnd) {
  const std::string whole = log();
  for (std::size_t size = 16; size < whole.size(); ++size) {
    const Result<Ulog> cut = Ulog::parse(std::string_view(whole).substr(0, size), "cut.ulg");
    EXPECT_TRUE(!cut || cut->seconds("torque").size() <= 2u);
  }
  const Result<Ulog> cut = Ulog::parse(std::string_view(whole).substr(0, whole.size() - 1), "cut.ulg");
  ASSERT_TRUE(cut);
  EXPECT_EQ(cut->seconds("torque").size(), 1u);
}

TEST(Ulog, RefusesOtherFilesInOneSentence) {
  const Result<Ulog> other = Ulog::parse("timestamp,x,y,z, and so on", "b.csv");
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().message, "b.csv: this is not a PX4 log (.ulg)");
}

}  // namespace ulog_test
}  // namespace fbvins
