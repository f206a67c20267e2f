// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/telemetry_log.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "fbvins/mavlink/wire.hpp"

namespace fbvins {
namespace telemetry_log_test {

TEST(TelemetryLog, EachFrameHasItsTimeBeforeIt) {
  const std::string path = (std::filesystem::path(testing::TempDir()) / "link.tlog").string();
  const std::vector<std::uint8_t> beat = encode_mavlink(HeartbeatMessage{}, MavlinkAddress{}, 1),
                                  sync = encode_mavlink(TimesyncMessage{7, 8}, MavlinkAddress{}, 2);
  std::vector<std::uint8_t> both = beat;
  both.insert(both.end(), sync.begin(), sync.end());
  {
    TelemetryLog log;
    ASSERT_TRUE(log.open(path));
    log.add(both, 0x0102);
    log.add(std::vector<std::uint8_t>{'g', 'a', 'r', 'b'}, 3);
    log.add(std::span(sync).first(5), 4);  // cut off
  }
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> got((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  ASSERT_EQ(got.size(), 8 + beat.size() + 8 + sync.size());
  EXPECT_EQ(std::vector<char>(got.begin(), got.begin() + 8), (std::vector<char>{0, 0, 0, 0, 0, 0, 1, 2}));
  MavlinkDecoder decoder;
  const std::vector<std::uint8_t> second(got.end() - static_cast<std::ptrdiff_t>(sync.size()), got.end());
  EXPECT_EQ(second, sync);
  EXPECT_EQ(decoder.push(second).size(), 1u);
}

TEST(TelemetryLog, AFolderThatIsNotThereIsSaid) { EXPECT_FALSE(TelemetryLog().open("/nowhere/at/all/link.tlog")); }

}  // namespace telemetry_log_test
}  // namespace fbvins
