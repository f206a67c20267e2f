// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/flight_summary.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "fbvins/io/trajectory.hpp"

namespace fbvins {
namespace flight_summary_test {

/// Stands for 3 s, jumps to (1, 0, 1) with an error of (1, -2, 3) cm and hovers for 5 s.
FlightLog hop() {
  FlightLog log;
  log.start = {so3_exp(Vec3(0, 0, 0.5)), Vec3(0, 0, 0.2)};
  log.mode = FlightMode::mission;
  for (int k = 0; k < 8 * 200; ++k) {
    FlightRow row;
    row.t_s = k / 200.0;
    row.battery_V = 16 - 0.1 * row.t_s;
    const bool up = row.t_s >= 3;
    row.autopilot.t = Time{1'000'000'000 + static_cast<std::int64_t>(k) * 5'000'000};
    row.autopilot.mode = up ? FlightMode::mission : FlightMode::waiting;
    row.autopilot.step = 1;
    row.autopilot.health = {HealthState::good, HealthReason::none};
    if (up) row.autopilot.setpoint.p = Vec3(1, 0, 1);
    if (up) row.autopilot.estimate.T_LV.p = Vec3(1, 0, 1);
    if (up) row.truth.p = Vec3(1.01, -0.02, 1.03);
    if (up) row.autopilot.control.commands = {0.6, 0.6, 0.6, 0.6};
    log.rows.push_back(row);
  }
  return log;
}

Mission up_and_hold() { return *parse_mission("steps:\n  - takeoff: 1\n  - goto: [1, 0, 1]\n", "m.yaml"); }

TEST(FlightSummary, HasTheValuesOfThePapersTable) {
  const FlightSummary s = summarise(hop(), up_and_hold());
  ASSERT_TRUE(s.arrived);
  EXPECT_NEAR(s.axes[2].start, 0.2, 1e-9);
  EXPECT_NEAR(s.axes[2].end, 1.23, 1e-9);
  EXPECT_NEAR(s.axes[2].difference, 1.03, 1e-9);
  EXPECT_NEAR(s.axes[2].expected, 1, 1e-9);
  EXPECT_NEAR(s.axes[0].error, 0.01, 1e-9);
  EXPECT_NEAR(s.axes[1].error, 0.02, 1e-9);
  EXPECT_NEAR(s.axes[2].error, 0.03, 1e-9);
  EXPECT_NEAR(s.mean_axial_error_m, 0.02, 1e-9);
  EXPECT_NEAR(s.distance_m, std::sqrt(0.0014), 1e-9);
  EXPECT_NEAR(s.estimation.rmse, std::sqrt(0.0014), 1e-9);
  EXPECT_NEAR(s.control.max, 0, 1e-12);
  EXPECT_NEAR(s.flown_s, 5, 0.02);
  ASSERT_EQ(s.modes.size(), 2u);
  EXPECT_EQ(s.modes[0].first, "waiting");
  EXPECT_NEAR(s.modes[1].second, 5, 0.02);
  EXPECT_NEAR(s.least_battery_V, 15.2, 0.01);
}

TEST(FlightSummary, ASingleRowHasNoDuration) {
  FlightLog log = hop();
  log.rows = {log.rows.back()};
  log.rows.shrink_to_fit();
  EXPECT_EQ(summarise(log, up_and_hold()).flown_s, 0);
}

TEST(FlightSummary, AFailsafeLandingOrACrashIsNotAnArrival) {
  FlightLog log = hop();
  log.reason = FlightReason::lost;
  EXPECT_FALSE(summarise(log, up_and_hold()).arrived);
  log = hop();
  log.crash = "collision";
  EXPECT_FALSE(summarise(log, up_and_hold()).arrived);
  log = {};
  EXPECT_FALSE(summarise(log, up_and_hold()).arrived);  // it never flew
}

TEST(FlightSummary, FilesReadBack) {
  const std::string folder = ::testing::TempDir() + "/fbvins_flight_files";
  std::filesystem::create_directories(folder);
  const Result<void> written = write_flight(hop(), folder);
  ASSERT_TRUE(written) << written.error().message;
  const auto truth = read_trajectory(folder + "/truth_tum.txt"), setpoint = read_trajectory(folder + "/setpoint_tum.txt");
  ASSERT_TRUE(truth && setpoint);
  EXPECT_EQ(truth->points.size(), 1600u);
  EXPECT_EQ(setpoint->points.size(), 1000u);
  EXPECT_LT((truth->points.back().T_WB.p - Vec3(1.01, -0.02, 1.03)).norm(), 1e-6);
  std::ifstream csv(folder + "/flight.csv");
  std::string header, row;
  std::getline(csv, header);
  std::getline(csv, row);
  EXPECT_EQ(header.substr(0, 29), "#timestamp [ns],t,true_p_x,tr");
  EXPECT_EQ(std::count(header.begin(), header.end(), ','), std::count(row.begin(), row.end(), ','));
  EXPECT_FALSE(write_flight(hop(), folder + "/none"));
  std::filesystem::remove_all(folder);
}

}  // namespace flight_summary_test
}  // namespace fbvins
