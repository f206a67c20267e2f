// SPDX-License-Identifier: Apache-2.0
#include "apps/run_summary.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace fbvins::app {
namespace run_summary_test {

Time at(int k) { return Time{1'000'000'000 + k * 50'000'000LL}; }

Odometry odometry(int k, HealthState state = HealthState::good, std::uint32_t reset_counter = 0) {
  Odometry o;
  o.id = FrameId{k};
  o.t = at(k);
  o.T_WB.p = Vec3(std::cos(0.05 * k), std::sin(0.05 * k), 0.01 * k);
  o.pose_covariance = 1e-4 * Mat6::Identity();
  o.health.state = state;
  o.reset_counter = reset_counter;
  o.stats.solve_ms = 3;
  return o;
}

RunRecord circle(int frames) {
  RunRecord record;
  for (int k = 0; k < frames; ++k) {
    record.odometry.push_back(odometry(k));
    TrackedRecord tracked{FrameId{k}, at(k), {}, {}};
    tracked.stats.track_ms = 5;
    record.tracked.push_back(tracked);
  }
  return record;
}

std::vector<Time> images(int frames) {
  std::vector<Time> stamps;
  for (int k = 0; k < frames; ++k) stamps.push_back(at(k));
  return stamps;
}

TEST(RunSummary, LabelsAreStateAndReason) {
  EXPECT_EQ(label_of({HealthState::good, HealthReason::none}), "good");
  EXPECT_EQ(label_of({HealthState::lost, HealthReason::no_images}), "lost/no_images");
}

TEST(RunSummary, CountsRestartsOnlyAfterTheFirstPose) {
  RunRecord record;
  record.odometry = {odometry(0, HealthState::initialising, 0), odometry(1, HealthState::initialising, 1),
                     odometry(2, HealthState::good, 1),         odometry(3, HealthState::lost, 1),
                     odometry(4, HealthState::initialising, 2), odometry(5, HealthState::good, 2)};
  const RunSummary s = summarise(record, images(6), {});
  EXPECT_EQ(s.restarts, 1);
  EXPECT_EQ(s.health.size(), 3u);
  EXPECT_EQ(s.no_evaluation, "the recording holds no ground truth");
}

TEST(RunSummary, ATimeOffsetThatWasFoundIsSaid) {
  RunRecord record = circle(10);
  EXPECT_EQ(to_text(summarise(record, images(10), {})).find("time offset"), std::string::npos);
  record.odometry.back().time_offset_s = 0.079;
  EXPECT_NE(to_text(summarise(record, images(10), {})).find("time offset: +79.0 ms more"), std::string::npos);
}

TEST(RunSummary, NamesTheCamerasThatWereNotUsed) {
  RunRecord record = circle(10);
  for (int k = 4; k < 10; ++k) record.odometry[static_cast<std::size_t>(k)].health.without_cameras = k < 7 ? 0b1 : 0b101;
  const std::string text = to_text(summarise(record, images(10), {}));
  EXPECT_NE(text.find("good 10, 6 without camera 0, 3 without camera 2\n"), std::string::npos) << text;
}

TEST(RunSummary, AgainstItsOwnTruthThereIsNoError) {
  const RunRecord record = circle(200);
  const RunSummary s = summarise(record, images(220), record.poses());
  ASSERT_TRUE(s.evaluation) << s.no_evaluation;
  EXPECT_LT(s.evaluation->absolute_m.rmse, 1e-6);
  EXPECT_EQ(s.coverage.images, 220);
  EXPECT_EQ(s.coverage.with_pose, 200);
  ASSERT_TRUE(s.nees);
  EXPECT_LT(s.nees->mean.position, 1e-3);
  EXPECT_EQ(s.frames, 200);
  EXPECT_EQ(s.frontend_ms.size(), 200u);
}

TEST(RunSummary, TextAndJsonSayTheSame) {
  const RunRecord record = circle(100);
  RunSummary s = summarise(record, images(100), record.poses());
  s.dataset = "circle", s.frontend = "klt", s.mode = "threaded", s.images_bad = 2;
  s.map.emplace().loops = 4;
  const std::string text = to_text(s), json = to_json_text(s);
  for (const char* part : {"circle with klt", "coverage 100.0 % of 100 images", "2 image files could not be used", "4 loops",
                           "map: never localised", "frontend       5.00 ms", "together       8.00 ms"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
  for (const char* part :
       {"\"dataset\": \"circle\"", "\"images_bad\": 2", "\"loops\": 4", "\"mode\": \"threaded\"", "\"good\": 100"})
    EXPECT_NE(json.find(part), std::string::npos) << part << " in\n" << json;
}

TEST(RunSummary, TheResultsPartHasNoTimes) {
  RunSummary fast = summarise(circle(50), images(50), {}), slow = fast;
  for (double& ms : slow.frontend_ms) ms *= 10;
  slow.wall_s = 100;
  slow.peak_memory_mb += 50;
  const auto result = [](const RunSummary& s) { return Json::parse(to_json_text(s))["result"].dump(); };
  EXPECT_EQ(result(fast), result(slow));
  EXPECT_NE(to_json_text(fast), to_json_text(slow));
}

}  // namespace run_summary_test
}  // namespace fbvins::app
