// SPDX-License-Identifier: Apache-2.0
#include "fbvins/config/option_tiers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "fbvins/config/config.hpp"

namespace fbvins {
namespace option_tiers_test {

std::vector<std::string> values_of(const std::vector<OptionField>& fields) {
  std::vector<std::string> paths;
  for (const OptionField& f : fields)
    if (!f.is_group()) paths.push_back(f.path);
  return paths;
}

TEST(OptionTiers, EveryUserOptionIsAnOptionInTheOrderOfTheConfiguration) {
  Config config;
  const auto chosen = user_options();
  EXPECT_EQ(values_of(user_fields(fields_of(config))), std::vector<std::string>(chosen.begin(), chosen.end()));
}

TEST(OptionTiers, ThereAreFewEnoughToRead) {
  Config config;
  EXPECT_LE(user_options().size(), 16u);
  // Seventeen for a flight controller, ten of names, clock, transforms, commands and quality of service for ROS 2, eleven of the
  // sensors that aid images and IMU.
  EXPECT_LE(values_of(fields_of(config)).size(), 80u);
}

TEST(OptionTiers, AGroupIsShownOnlyWithAUserOption) {
  Config config;
  const auto fields = user_fields(fields_of(config));
  const auto has = [&](const std::string& path) {
    return std::any_of(fields.begin(), fields.end(), [&](const OptionField& f) { return f.path == path; });
  };
  EXPECT_TRUE(has("frontend.orb"));
  EXPECT_FALSE(has("frontend.orb.recognition"));
  EXPECT_FALSE(has("loop.verification"));
}

TEST(OptionTiers, TheTutorialExplainsEachOfThem) {
  std::ifstream file(FBVINS_SOURCE_DIR "/docs/tutorial.md");
  const std::string tutorial{std::istreambuf_iterator<char>(file), {}};
  for (const std::string_view path : user_options())
    EXPECT_NE(tutorial.find("`" + std::string(path) + "`"), std::string::npos) << path;
}

}  // namespace option_tiers_test
}  // namespace fbvins
