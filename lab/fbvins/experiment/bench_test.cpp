// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <future>

#include "fbvins/experiment/bench_results.hpp"
#include "fbvins/experiment/bench_runner.hpp"
#include "fbvins/experiment/bench_tables.hpp"

namespace fbvins {
namespace bench_test {

namespace fs = std::filesystem;

/// A fake fbvins that logs its calls, and fails at the job named in the file `fail`.
constexpr const char* kProgram = R"SH(#!/bin/sh
here=$(dirname "$0")
echo "$*" >> "$here/calls"
command=$1 subject=$2 out=
while [ $# -gt 0 ]; do [ "$1" = --out ] && out=$2; shift; done
[ -e "$here/fail" ] && [ "$command-$(basename "$subject")" = "$(cat "$here/fail")" ] && {
  echo "it broke";
  exit 3;
}
mkdir -p "$out"
[ $command = simulate ] && echo x > "$out/simulation.yaml" || echo '{}' > "$out/summary.json"
)SH";

class BenchRunner : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              ("bench_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    write("fbvins", kProgram);
    fs::permissions(folder_ / "fbvins", fs::perms::owner_all);
    const Result<Matrix> matrix =
        parse_matrix("datasets:\n  - simulate: {preset: [normal, fast], seeds: 2}\nfrontends: [klt, orb]\n", "m.yaml");
    ASSERT_TRUE(matrix.ok());
    const Result<Plan> plan = make_plan(*matrix, {.rendered = (folder_ / "rendered").string()});
    ASSERT_TRUE(plan.ok());
    plan_ = *plan;
    options_ = {.program = (folder_ / "fbvins").string(), .out = (folder_ / "out").string(), .jobs = 3};
  }
  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  std::vector<std::string> calls() const {
    std::ifstream file(folder_ / "calls");
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
  }
  BenchOutcome run() {
    steps_.clear();
    const Result<BenchOutcome> outcome = run_plan(plan_, options_, [&](const BenchStep& s) { steps_.push_back(s); });
    EXPECT_TRUE(outcome.ok());
    return outcome ? *outcome : BenchOutcome{};
  }

  fs::path folder_;
  Plan plan_;
  BenchOptions options_;
  std::vector<BenchStep> steps_;
};

TEST_F(BenchRunner, RendersOnceAndRunsEachCell) {
  const BenchOutcome outcome = run();
  EXPECT_EQ(outcome.run, 8);
  EXPECT_TRUE(outcome.failed.empty());
  EXPECT_EQ(calls().size(), 4u + 8u);
  EXPECT_DOUBLE_EQ(steps_.back().share, 1);
  EXPECT_EQ(steps_.back().cells_done, 8);
  for (const Cell& cell : plan_.cells) EXPECT_TRUE(fs::exists(cell_folder(options_.out, cell) + "/cell.json")) << cell.id;
}

TEST_F(BenchRunner, FinishedCellsAreNotRunAgain) {
  run();
  const BenchOutcome again = run();
  EXPECT_EQ(again.run, 0);
  EXPECT_EQ(again.reused, 8);
  EXPECT_EQ(calls().size(), 12u);
}

TEST_F(BenchRunner, OnlyFailedCellsAreRunAgain) {
  write("fail", "run-fast-s2");
  const BenchOutcome first = run();
  ASSERT_EQ(first.failed.size(), 2u);
  EXPECT_NE(first.failed[0].find("exit code 3: it broke"), std::string::npos) << first.failed[0];
  EXPECT_EQ(first.run, 6);
  fs::remove(folder_ / "fail");
  const BenchOutcome second = run();
  EXPECT_EQ(second.run, 2);
  EXPECT_EQ(second.reused, 6);
}

TEST_F(BenchRunner, CellsFailIfTheirRecordingCannotBeRendered) {
  write("fail", "simulate-normal");
  const BenchOutcome outcome = run();
  EXPECT_EQ(outcome.run, 4);
  EXPECT_EQ(outcome.failed.size(), 2u + 4u);
}

TEST_F(BenchRunner, AnIncompleteCellIsRunAgain) {
  run();
  const std::string cell = cell_folder(options_.out, plan_.cells[0]);
  fs::rename(cell, cell + ".part");  // as after a kill
  EXPECT_EQ(run().run, 1);
  EXPECT_FALSE(fs::exists(cell + ".part"));
}

TEST_F(BenchRunner, AChangedProgramOrConfigurationIsRunAgain) {
  run();
  plan_.cells[0].configuration.settings = {"a=1"};
  EXPECT_EQ(run().run, 1);
  write("fbvins", std::string(kProgram) + "# changed\n");
  EXPECT_EQ(run().run, 8);
}

TEST_F(BenchRunner, ASecondBenchInAFolderIsRefused) {
  std::string refusal;
  const auto second = [&](const BenchStep&) {
    if (!refusal.empty()) return;
    const Result<BenchOutcome> outcome = run_plan(plan_, options_, {});
    refusal = outcome ? "none" : outcome.error().message;
  };
  ASSERT_TRUE(run_plan(plan_, options_, second).ok());
  EXPECT_EQ(refusal, options_.out + ": another bench works in this folder");
}

TEST_F(BenchRunner, AFolderThatCannotBeLockedOrMadeIsNamedWithTheReason) {
  fs::create_directories(fs::path(options_.out) / "lock");
  EXPECT_EQ(run_plan(plan_, options_, {}).error().message, options_.out + "/lock: Is a directory");
  fs::remove_all(options_.out);
  fs::create_directories(options_.out);
  write("out/cells", "a file");
  EXPECT_EQ(run_plan(plan_, options_, {}).error().message, options_.out + "/cells: Not a directory");
}

TEST_F(BenchRunner, RenderedRecordingsCanBeDiscarded) {
  options_.discard_rendered = true;
  run();
  for (const Recording& r : plan_.recordings) EXPECT_FALSE(fs::exists(r.path)) << r.path;
  EXPECT_EQ(run().reused, 8);  // nothing is rendered again
  EXPECT_EQ(calls().size(), 12u);
}

TEST_F(BenchRunner, SingleCellsCompleteThePlan) {
  for (const Cell& cell : plan_.cells) {
    const Result<BenchOutcome> outcome = run_cell(plan_, options_, cell.id);
    ASSERT_TRUE(outcome.ok()) << outcome.error().message;
    EXPECT_EQ(outcome->run, 1) << cell.id;
  }
  EXPECT_EQ(run_cell(plan_, options_, plan_.cells[3].id)->reused, 1);
  EXPECT_EQ(calls().size(), 4u + 8u);  // each recording was rendered once
  EXPECT_EQ(run().reused, 8);
}

TEST_F(BenchRunner, ConcurrentRunsOfACellDoItOnce) {
  std::vector<std::future<Result<BenchOutcome>>> workers;
  for (int i = 0; i < 6; ++i)
    workers.push_back(std::async(std::launch::async, [this] { return run_cell(plan_, options_, plan_.cells[0].id); }));
  int done = 0, found = 0;
  for (auto& worker : workers) {
    const Result<BenchOutcome> outcome = worker.get();
    ASSERT_TRUE(outcome.ok()) << outcome.error().message;
    done += outcome->run;
    found += outcome->reused;
  }
  EXPECT_EQ(done, 1);
  EXPECT_EQ(found, 5);
  EXPECT_EQ(calls().size(), 2u);
}

TEST_F(BenchRunner, AFailedCellReportsTheReasonAndIsTriedAgain) {
  write("fail", "run-normal-s1");
  const Result<BenchOutcome> first = run_cell(plan_, options_, plan_.cells[0].id);
  ASSERT_TRUE(first.ok());
  ASSERT_EQ(first->failed.size(), 1u);
  EXPECT_EQ(first->failed[0], "normal-s1-klt: exit code 3: it broke");
  write("fail", "simulate-fast");
  EXPECT_EQ(run_cell(plan_, options_, "fast-s1-klt")->failed.at(0), "fast-s1: exit code 3: it broke");
  fs::remove(folder_ / "fail");
  EXPECT_EQ(run_cell(plan_, options_, plan_.cells[0].id)->run, 1);
}

TEST_F(BenchRunner, AnUnknownCellIsAnError) {
  const Result<BenchOutcome> outcome = run_cell(plan_, options_, "slow-s1-klt");
  ASSERT_FALSE(outcome.ok());
  EXPECT_EQ(outcome.error().message, "there is no cell 'slow-s1-klt'");
}

TEST_F(BenchRunner, SingleCellsAndAWholePlanExcludeOneAnother) {
  std::string refusal;
  const auto second = [&](const BenchStep&) {
    if (!refusal.empty()) return;
    const Result<BenchOutcome> outcome = run_cell(plan_, options_, plan_.cells[0].id);
    refusal = outcome ? "none" : outcome.error().message;
  };
  ASSERT_TRUE(run_plan(plan_, options_, second).ok());
  EXPECT_EQ(refusal, options_.out + ": another bench works in this folder");
}

CellResult result(const std::string& dataset, int seed, const std::string& frontend, double rmse) {
  CellResult r;
  r.recording = {dataset + std::to_string(seed), dataset, "", seed, RenderSpec{}};
  r.cell = {r.recording.id + "-" + frontend, 0, frontend, {}, 1};
  r.status = "ok";
  Evaluation e;
  e.absolute_m = {100, 3 * rmse, rmse, rmse, rmse, rmse};
  r.evaluation = e;
  r.coverage = 0.99;
  return r;
}

TEST(BenchTables, ReductionsAreMeansOverRecordings) {
  // As in section 3.2: the mean of the reductions of the recordings, here 50 % and 10 %.
  const auto payload = bench_payload(
      "T", {result("A", 1, "klt", 0.4), result("A", 1, "orb", 0.2), result("B", 1, "klt", 0.1), result("B", 1, "orb", 0.09)}, {});
  ASSERT_EQ(payload["tables"].size(), 2u);
  EXPECT_EQ(payload["tables"][0]["rows"][1][5], "0.2000");
  EXPECT_EQ(payload["tables"][1]["title"], "Reduction against klt");
  EXPECT_EQ(payload["tables"][1]["rows"][0][4], "30.00 %");
  EXPECT_NE(markdown(payload).find("| A | orb | 0.6000 |"), std::string::npos);
}

TEST(BenchTables, SeedsOfAScenarioShareARow) {
  const auto payload = bench_payload("T", {result("A", 1, "klt", 0.1), result("A", 2, "klt", 0.3)}, {});
  const auto& rows = payload["tables"][0]["rows"];
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0][2], "2");
  EXPECT_EQ(rows[0][3], "0.2000");
}

TEST(BenchTables, RepetitionsAreNoFlights) {
  std::vector<CellResult> results;
  for (const int seed : {1, 2})
    for (const int repetition : {1, 2, 3}) {
      CellResult& cell = results.emplace_back(result("A", seed, "klt", 0.1));
      cell.cell.repetition = repetition;
      cell.nees = {3, 3, 3, 3, 3};
      for (int tenth = 0; tenth < 10; ++tenth) cell.nees_over_time.emplace_back(0.1 * tenth, cell.nees);
    }
  const auto payload = bench_payload("T", results, {});
  EXPECT_EQ(payload["tables"][0]["rows"][0][2], "2");
  ASSERT_EQ(payload["tables"][1]["title"], "Consistency");
  ASSERT_EQ(payload["tables"][1]["rows"].size(), 1u);
  EXPECT_EQ(payload["tables"][1]["rows"][0][2], "2");
  EXPECT_EQ(payload["tables"][1]["rows"][0][3], "3.00 (100 %)");
  EXPECT_EQ(payload["consistency"][0]["flights"], 2);
}

TEST(BenchTables, BoundsOfChiSquare) {
  // Quantiles 0.025 and 0.975 of chi-square with 60 degrees of freedom: 40.48 and 83.30.
  EXPECT_NEAR(nees_bounds(20).low, 40.48 / 20, 0.005);
  EXPECT_NEAR(nees_bounds(20).high, 83.30 / 20, 0.005);
}

TEST(BenchResults, FindsRegressionsAndNothingElse) {
  const std::string path = ::testing::TempDir() + "/reference.csv";
  std::ofstream(path) << results_csv({result("A", 1, "klt", 0.10), result("B", 1, "klt", 0.10), result("C", 1, "klt", 0.10)});
  const auto reference = read_reference(path);
  ASSERT_TRUE(reference.ok()) << reference.error().message;
  CellResult slightly = result("A", 1, "klt", 0.12), worse = result("B", 1, "klt", 0.13), blind = result("C", 1, "klt", 0.05);
  blind.coverage = 0.5;
  const std::vector<Regression> found = regressions({slightly, worse, blind, result("D", 1, "klt", 9)}, *reference, {});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].cell, "B1-klt");
  EXPECT_EQ(found[1].what, "coverage 50.0 %, was 99.0");
}

TEST(BenchResults, AFieldThatIsNoNumberIsNotCompared) {
  const std::string path = ::testing::TempDir() + "/damaged.csv";
  std::ofstream(path) << "cell,rmse_m,coverage,restarts\nA1-klt,0.1,0.99,many\nB1-klt,0.1,0.99,2\n";
  const auto reference = read_reference(path);
  ASSERT_TRUE(reference.ok()) << reference.error().message;
  CellResult a = result("A", 1, "klt", 0.1), b = result("B", 1, "klt", 0.1);
  a.restarts = b.restarts = 3;
  const std::vector<Regression> found = regressions({a, b}, *reference, {});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].what, "3 restarts, were 2");
}

}  // namespace bench_test
}  // namespace fbvins
