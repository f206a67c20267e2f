// SPDX-License-Identifier: Apache-2.0
// Its use for calibrations, configurations and matrices is tested with each of them.
#include "fbvins/io/yaml_reader.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace yaml_reader_test {

TEST(YamlReader, TheFirstComplaintStays) {
  YamlReader yaml("f.yaml", "a: 1\nb: -2\nc: [1, [2, 3]]\n");
  EXPECT_EQ(yaml.number(yaml.root(), "a"), 1);
  EXPECT_EQ(yaml.numbers(yaml.root(), "c", 3), (std::vector<double>{1, 2, 3}));
  ASSERT_TRUE(yaml.ok());
  EXPECT_EQ(yaml.positive(yaml.root(), "b"), 1) << "a harmless value";
  EXPECT_EQ(yaml.numbers(yaml.root(), "d", 2).size(), 2u);
  EXPECT_EQ(yaml.error().message, "f.yaml:2: b: -2 is not positive");
}

TEST(YamlReader, FieldsThatMayBeLeftOut) {
  YamlReader yaml("f.yaml", "one: x\nmany: [x, y]\nn: 7\n");
  EXPECT_EQ(yaml.text(yaml.root(), "one"), "x");
  EXPECT_EQ(yaml.text(yaml.root(), "none"), "");
  EXPECT_EQ(yaml.texts(yaml.root(), "one"), (std::vector<std::string>{"x"}));
  EXPECT_EQ(yaml.texts(yaml.root(), "many"), (std::vector<std::string>{"x", "y"}));
  EXPECT_TRUE(yaml.texts(yaml.root(), "none").empty());
  EXPECT_EQ(yaml.number_between(yaml.root(), "none", 1, 5, 3), 3);
  ASSERT_TRUE(yaml.ok());
  EXPECT_EQ(yaml.number_between(yaml.root(), "n", 1, 5, 3), 3);
  EXPECT_EQ(yaml.error().message, "f.yaml:3: 'n' must be a number from 1 to 5");
}

TEST(YamlReader, OnlyKnownFields) {
  YamlReader yaml("f.yaml", "path: a\ncolour: red\n");
  yaml.only(yaml.root(), {"path", "colour"});
  ASSERT_TRUE(yaml.ok());
  yaml.only(yaml.root(), {"path", "name"});
  EXPECT_EQ(yaml.error().message, "f.yaml:2: unknown key 'colour'; known here: path, name");
}

TEST(YamlReader, BrokenTextIsSaidWithItsLineAndEveryGetterStillAnswers) {
  YamlReader yaml("f.yaml", "a: 1\nb: [1, 2\n");
  EXPECT_EQ(yaml.error().message.substr(0, 18), "f.yaml:3: not YAML");
  EXPECT_FALSE(yaml.has(yaml.root(), "a"));
  EXPECT_EQ(yaml.number(yaml.root(), "a"), 0);
  EXPECT_TRUE(yaml.texts(yaml.root(), "a").empty());
}

TEST(YamlReader, AnEmptyFileIsAcceptedWhereAllowed) {
  EXPECT_EQ(YamlReader("f.yaml", "").error().message, "f.yaml: holds no fields");
  EXPECT_TRUE(YamlReader("f.yaml", "", YamlReader::Root::anything).ok());
  EXPECT_TRUE(YamlReader("f.yaml", "%YAML:1.0\n---\na: 1\n").ok()) << "OpenCV's header";
}

}  // namespace yaml_reader_test
}  // namespace fbvins
