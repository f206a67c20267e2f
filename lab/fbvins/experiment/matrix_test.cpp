// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/matrix.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

namespace fbvins {
namespace matrix_test {

TEST(Matrix, ACellForEachCombination) {
  const Result<Matrix> matrix = parse_matrix(R"(
datasets:
  - {path: /data/MH_01_easy.zip}
  - simulate: {preset: [normal, fast], seconds: 8, seeds: 3}
frontends: [klt, orb]
configurations:
  - {name: default}
  - {name: entropy, set: [estimator.keyframes.leaving=entropy]}
repetitions: 2
)",
                                             "m.yaml");
  ASSERT_TRUE(matrix.ok()) << matrix.error().message;
  const Result<Plan> plan = make_plan(*matrix, {.rendered = "/rendered"});
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  EXPECT_EQ(plan->recordings.size(), 7u);  // one, and two presets with three seeds each
  EXPECT_EQ(plan->cells.size(), 7u * 2 * 2 * 2);
  EXPECT_EQ(plan->recordings[1].path, "/rendered/normal-8s-s1");
  EXPECT_EQ(plan->recordings[6].seed, 3);
  EXPECT_EQ(plan->cells[3].id, "MH_01_easy-klt-entropy-r2");
  std::set<std::string> ids;
  for (const Cell& cell : plan->cells) ids.insert(cell.id);
  EXPECT_EQ(ids.size(), plan->cells.size());
}

TEST(Matrix, PrefersTheRealRecordingToRendering) {
  const std::string folder = ::testing::TempDir() + "/euroc_matrix_test";
  std::filesystem::create_directories(folder + "/A");
  const Result<Matrix> matrix = parse_matrix(R"(
datasets:
  - {euroc: A, simulate: {trajectory: A/groundtruth.csv, imu: A/imu0.csv}, name: A}
  - {euroc: B, simulate: {trajectory: B/groundtruth.csv, imu: B/imu0.csv}, name: B}
)",
                                             "m.yaml");
  ASSERT_TRUE(matrix.ok()) << matrix.error().message;
  const Result<Plan> plan = make_plan(*matrix, {.euroc = folder, .inputs = "/in", .rendered = "/rendered"});
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(plan->recordings[0].path, folder + "/A");
  EXPECT_FALSE(plan->recordings[0].rendered.has_value());
  EXPECT_EQ(plan->recordings[1].path, "/rendered/B");
  EXPECT_EQ(plan->recordings[1].rendered->imu, "/in/B/imu0.csv");
}

TEST(Matrix, ErrorsNameTheLine) {
  const auto message = [](const char* text) { return parse_matrix(text, "m.yaml").error().message; };
  EXPECT_EQ(message("datasets:\n  - {path: a, colour: red}\n"),
            "m.yaml:2: unknown key 'colour'; known here: name, euroc, path, simulate");
  EXPECT_EQ(message("frontends: [klt]\n"), "m.yaml:1: a list 'datasets' is needed");
  EXPECT_EQ(message("datasets: [{path: a}]\nrepetitions: many\n"), "m.yaml:2: 'repetitions' must be a number from 1 to 1000");
  EXPECT_NE(message("datasets: [{path: a\n").find("m.yaml:"), std::string::npos);
  EXPECT_EQ(message("datasets: [{path: a}]\nfrontends: [klt, surf]\n"),
            "m.yaml:2: there is no frontend 'surf'; there are klt, orb, boost");
  EXPECT_EQ(message("datasets: [{name: a}]\n"), "m.yaml:1: a dataset needs euroc, path or simulate");
}

TEST(Matrix, DuplicateNamesOfDatasetsAreRefused) {
  const Result<Matrix> matrix = parse_matrix("datasets: [{path: a/x}, {path: b/x}]\n", "m.yaml");
  ASSERT_TRUE(matrix.ok());
  EXPECT_EQ(make_plan(*matrix, {}).error().message, "two datasets are called x");
}

}  // namespace matrix_test
}  // namespace fbvins
