// SPDX-License-Identifier: Apache-2.0
#include "fbvins/report/report.hpp"

#include <gtest/gtest.h>

#include "tests/support/test_run.hpp"

namespace fbvins {
namespace report_test {

using Json = nlohmann::ordered_json;

RunFolder complete_run() {
  RunFolder run = circling_run(1);
  run.summary = Json::parse(R"({"result": {"coverage": {"share": 1.0}, "restarts": 0}, "timing": {"total_ms": {"mean": 4.2}}})");
  run.config = "a: 1  # </script> & <b>\n";
  return run;
}

/// The data that the page's script reads.
Json data_of(const std::string& html) {
  const std::string open = "<script type=\"application/json\" id=\"data\">";
  const std::size_t from = html.find(open) + open.size();
  return Json::parse(html.substr(from, html.find("</script>", from) - from));
}

TEST(Report, HasTheNumbersOfTheEvaluation) {
  const RunFolder run = complete_run();
  const Json data = data_of(report_html({run}, nullptr, {}));
  ASSERT_EQ(data["runs"].size(), 1u);
  const Json& shown = data["runs"][0];
  EXPECT_NEAR(shown["table"]["absolute_m"]["rmse"].get<double>(), 0.0173, 0.003);  // sqrt(3) times 1 cm
  EXPECT_EQ(shown["errors"]["t"].size(), 200u);
  EXPECT_EQ(shown["errors"]["absolute_m"].size(), 200u);
  EXPECT_NEAR(shown["nees"]["velocity"].get<double>(), 3, 0.6);
  EXPECT_EQ(shown["config"], run.config);
}

TEST(Report, ShowsAFlight) {
  RunFolder run = complete_run();
  FlightFiles flight;
  flight.summary = Json::parse(R"({"arrived": true})");
  flight.rows = *CsvTable::parse("#timestamp [ns],true_p_x,mode,mode_reason\n" + std::to_string(run.start().ns) +
                                     ",1,waiting,none\n" + std::to_string(run.start().ns + 500'000'000) + ",2,mission,none\n" +
                                     std::to_string(run.start().ns + 1'000'000'000) + ",3,holding,late\n",
                                 "flight.csv");
  run.flight = flight;
  const Json shown = data_of(report_html({run}, nullptr, {}))["runs"][0]["flight"];
  EXPECT_EQ(shown["curves"]["true_p_x"], Json({1, 2, 3}));
  EXPECT_EQ(shown["modes"][1], Json({0.5, 1.0, "mission", "none"}));
  EXPECT_EQ(shown["modes"][2][3], "late");
  EXPECT_TRUE(shown["summary"]["arrived"]);
}

TEST(Report, ValuesCannotEndTheScript) {
  const std::string html = report_html({complete_run()}, nullptr, {.title = "<b>&"});
  EXPECT_NE(html.find("<title>&lt;b>&amp;</title>"), std::string::npos);
  EXPECT_EQ(data_of(html)["title"], "<b>&");
}

TEST(Report, BytesThatAreNoTextAreReplaced) {
  RunFolder run = complete_run();
  run.flight = FlightFiles{Json{{"mission", "m\xff.yaml"}},
                           *CsvTable::parse("#timestamp [ns],mode,mode_reason\n1,fly\xff,none\n", "flight.csv")};
  const Json data = data_of(report_html({run}, Json{{"name", "b\xff"}}, {.title = "t\xff"}));
  EXPECT_EQ(data["title"], "t\xef\xbf\xbd");
  EXPECT_EQ(data["bench"]["name"], "b\xef\xbf\xbd");
  EXPECT_EQ(data["runs"][0]["flight"]["summary"]["mission"], "m\xef\xbf\xbd.yaml");
}

TEST(Report, FetchesNothing) {
  const std::string html = report_html({complete_run()}, nullptr, {});
  for (const char* sign : {"src=", "href=", "@import", "fetch("}) EXPECT_EQ(html.find(sign), std::string::npos) << sign;
}

TEST(Report, HealthIntervalsCoverTheRun) {
  const Json health = data_of(report_html({complete_run()}, nullptr, {}))["runs"][0]["health"];
  ASSERT_EQ(health.size(), 3u);
  EXPECT_EQ(health[1], Json({7.5, 7.55, "degraded", "few_tracks"}));
  EXPECT_EQ(health[2][1], 9.95);
}

TEST(Report, LongRunsAreDecimated) {
  const Json data = data_of(report_html({complete_run()}, nullptr, {.max_points = 50}));
  EXPECT_EQ(data["runs"][0]["errors"]["t"].size(), 50u);
  EXPECT_EQ(data["runs"][0]["table"]["absolute_m"]["count"], 200);
}

TEST(Report, WithoutTruthThereAreNoErrors) {
  RunFolder run = complete_run();
  run.truth.clear();
  const Json data = data_of(report_html({run}, nullptr, {}));
  EXPECT_FALSE(data["runs"][0].contains("errors"));
  EXPECT_EQ(data["runs"][0]["odometry"]["t"].size(), 200u);
}

}  // namespace report_test
}  // namespace fbvins
