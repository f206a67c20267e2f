// SPDX-License-Identifier: Apache-2.0
#include "fbvins/config/config_file.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <set>

#include "fbvins/config/option_fields.hpp"
#include "fbvins/config/yaml.hpp"
#include "fbvins/core/options.hpp"
#include "fbvins/io/flight_record.hpp"

namespace fbvins {
namespace config_file_test {

TEST(ConfigFile, DefaultsAreValidAndRoundTrip) {
  EXPECT_TRUE(validate(Config{}));
  const std::string text = to_yaml(Config{});
  Config back;
  const auto read = read_yaml(text, "defaults", fields_of(back));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(to_yaml(back), text);
}

TEST(ConfigFile, EveryOptionCanBeSetToBothEndsOfItsRange) {
  Config config;
  for (const OptionField& field : fields_of(config)) {
    EXPECT_FALSE(field.meaning.empty()) << field.path;
    if (!std::holds_alternative<int*>(field.value) && !std::holds_alternative<double*>(field.value)) continue;
    EXPECT_LT(field.min, field.max) << field.path;
    EXPECT_TRUE(field.set_from_text(fmt::format("{}", field.min))) << field.path;
    EXPECT_TRUE(field.set_from_text(fmt::format("{}", field.max))) << field.path;
    EXPECT_FALSE(field.set_from_text(fmt::format("{}", field.max * 2 + 1))) << field.path;
  }
  EXPECT_TRUE(validate(config));
}

TEST(ConfigFile, NoTwoOptionsShareAName) {
  Config config;
  std::set<std::string> paths;
  for (const OptionField& field : fields_of(config)) EXPECT_TRUE(paths.insert(field.path).second) << field.path;
}

TEST(ConfigFile, AssignmentsComeAfterTheFileAndInOrder) {
  const auto config = load_config("", {"frontend.kind=orb", "estimator.max_iterations=7", "estimator.max_iterations=9"});
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_EQ(config->frontend.kind, "orb");
  EXPECT_EQ(config->estimator.max_iterations, 9);
  EXPECT_FALSE(load_config("", {"estimator.max_iteration=7"}));
  EXPECT_FALSE(load_config("no/such/file.yaml"));
}

TEST(ConfigFile, AProfileComesBeforeTheFileAndTheAssignments) {
  for (const Profile& profile : profiles()) {
    const auto config = load_config("", {"estimator.max_iterations=9"}, profile.name);
    ASSERT_TRUE(config) << config.error().message;
    EXPECT_EQ(config->estimator.max_iterations, 9);
    EXPECT_NE(to_yaml(*load_config("", {}, profile.name)), to_yaml(Config{}));
  }
  EXPECT_EQ(load_config("", {}, "a55")->frontend.kind, "klt");
  EXPECT_FALSE(load_config("", {}, "z80"));
}

TEST(ConfigFile, AFlightRecordGivesTheFlightsConfiguration) {
  const std::string path = ::testing::TempDir() + "/fbvins_config_" + std::to_string(getpid()) + ".mcap";
  Config flown;
  flown.frontend.kind = "orb";
  flown.estimator.accel_noise_scale = 1.0 / 3 + 16;
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{40, 41, 15, 11}, 32, 24), {}});
  rig.cameras[1].T_BC.p.x() = 0.1;
  ASSERT_TRUE(FlightRecord::create(path, rig, {.configuration = to_yaml(flown)}));
  const auto config = load_config(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_EQ(to_yaml(*config), to_yaml(flown));

  ASSERT_TRUE(FlightRecord::create(path, rig, {.configuration = "no_such_option: 1\n"}));
  const auto refused = load_config(path);
  std::filesystem::remove(path);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().message.starts_with(path + ": config.yaml:1: ")) << refused.error().message;
}

}  // namespace config_file_test
}  // namespace fbvins
