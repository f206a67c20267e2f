// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/status_sink.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "fbvins/live/latency_histogram.hpp"
#include "fbvins/types/quality.hpp"

namespace fbvins {
namespace status_sink_test {

TEST(StatusLine, IsJsonWithThePoseOnlyWhereThereIsOne) {
  LiveStatus status;
  status.health = {HealthState::degraded, HealthReason::no_images};
  status.counts.images_dropped = 7;
  status.problem = "a \"quoted\" name\n";
  LivePose pose;
  pose.T_WB.p = Vec3(1, 2, 3);
  const auto without = nlohmann::json::parse(to_json_line(status, pose));
  EXPECT_FALSE(without.contains("position_m"));
  EXPECT_EQ(without["reason"], "no_images");
  EXPECT_EQ(without["counts"]["images_dropped"], 7);
  EXPECT_EQ(without["problem"], status.problem);
  EXPECT_FALSE(without.contains("level"));
  EXPECT_FALSE(without.contains("outputs"));
  status.outputs = {
      {"mavlink udp", {{"clock_known", true}, {"round_trip_ms", 1.5}, {"poses_sent", std::int64_t{7}}, {"file", "a"}}}};
  EXPECT_EQ(
      nlohmann::json::parse(to_json_line(status, pose))["outputs"],
      nlohmann::json::parse(R"([{"output":"mavlink udp","clock_known":true,"round_trip_ms":1.5,"poses_sent":7,"file":"a"}])"));
  pose.health = status.health;
  pose.tilt_sigma_rad = 0.01;
  EXPECT_EQ(nlohmann::json::parse(to_json_line(status, pose))["tilt_sigma_rad"], 0.01);
  EXPECT_EQ(nlohmann::json::parse(to_json_line(status, pose))["level"], false);
  EXPECT_EQ(nlohmann::json::parse(to_json_line(status, pose))["quality_percent"],
            quality_percent(pose.health, pose.pose_covariance));
  EXPECT_EQ(nlohmann::json::parse(to_json_line(status, pose))["position_m"][2], 3);
  EXPECT_EQ(to_json_line(status, pose).find('\n'), std::string::npos);
}

TEST(StatusSink, WritesALineForEachStatusWithTheNewestPose) {
  std::FILE* file = std::tmpfile();
  ASSERT_NE(file, nullptr);
  StatusSink sink(file);
  LivePose pose;
  pose.health.state = HealthState::good;
  for (const double x : {1.0, 2.0}) {
    pose.T_WB.p.x() = x;
    EXPECT_TRUE(sink.take(pose));
  }
  EXPECT_TRUE(sink.take(ImuSample{}));
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(sink.take(LiveStatus{}));
  std::rewind(file);
  std::string text(10000, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file));
  std::fclose(file);
  ASSERT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
  EXPECT_EQ(nlohmann::json::parse(text.substr(0, text.find('\n')))["position_m"][0], 2.0);
}

TEST(StatusSink, AFullDiskIsAnErrorOfEveryStatus) {
  std::FILE* full = std::fopen("/dev/full", "w");
  if (full == nullptr) GTEST_SKIP() << "this system has no /dev/full";
  StatusSink sink(full);
  for (int i = 0; i < 2; ++i) EXPECT_FALSE(sink.take(LiveStatus{}));
  EXPECT_TRUE(sink.take(ImuSample{}));
  std::fclose(full);
}

TEST(LatencyHistogram, PercentilesAreWithinABin) {
  LatencyHistogram histogram;
  for (int k = 1; k <= 1000; ++k) histogram.add(Duration::from_seconds(k * 1e-4));  // 0.1 to 100 ms
  const LatencySummary summary = histogram.summary();
  EXPECT_NEAR(summary.p50_ms, 50, 50 * 0.021);
  EXPECT_NEAR(summary.p99_ms, 99, 99 * 0.021);
  EXPECT_DOUBLE_EQ(summary.max_ms, 100);
  EXPECT_EQ(summary.count, 1000);
}

}  // namespace status_sink_test
}  // namespace fbvins
