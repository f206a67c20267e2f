// SPDX-License-Identifier: Apache-2.0
#include "fbvins/config/yaml.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/options.hpp"

namespace fbvins {
namespace yaml_test {

enum class Leaving { oldest, entropy };

struct TrackerOptions {
  int max_features = 150;
  double min_distance_px = 20;
  bool subpixel = true;
  Leaving leaving = Leaving::oldest;
  template <class V>
  void visit(V&& v) {
    v("max_features", max_features, "", "features followed at once", 10, 5000);
    v("min_distance_px", min_distance_px, "px", "smallest distance between features", 2.0, 200.0);
    v("subpixel", subpixel, "", "refine below a pixel");
    v("leaving", leaving, "oldest|entropy", "which keyframe leaves");
  }
};

struct SomeConfig {
  std::string frontend = "klt";
  std::string note;
  double noise = 1.6968e-4;
  TrackerOptions klt;
  template <class V>
  void visit(V&& v) {
    v("frontend", frontend, "klt|orb", "how features are followed");
    v("note", note, "", "free text");
    v("noise", noise, "rad/s/sqrt(Hz)", "density", 1e-9, 1.0);
    v.group("klt", klt, "optical flow");
  }
};

std::string error_of(const std::string& text) {
  SomeConfig config;
  const Result<void> read = read_yaml(text, "f.yaml", fields_of(config));
  return read ? "" : read.error().message;
}

TEST(Yaml, SetsWhatItNamesAndLeavesTheRest) {
  SomeConfig config;
  const auto read = read_yaml("frontend: orb\nklt:\n  max_features: 300\n  subpixel: false\n", "f.yaml", fields_of(config));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(config.frontend, "orb");
  EXPECT_EQ(config.klt.max_features, 300);
  EXPECT_FALSE(config.klt.subpixel);
  EXPECT_EQ(config.klt.min_distance_px, 20);
  EXPECT_TRUE(validate(config));
}

TEST(Yaml, RoundTripsToTheSameBytesAndBits) {
  SomeConfig config;
  config.noise = 0.1 + 0.2;  // needs 17 digits
  config.note = "a \"quoted\" # text:\n\ttab \\ end, \x01 and \xc3\xa9";
  config.klt.min_distance_px = 1e2 / 3;
  const std::string text = write_yaml(fields_of(config));
  SomeConfig back;
  const auto read = read_yaml(text, "f.yaml", fields_of(back));
  ASSERT_TRUE(read) << read.error().message << "\n" << text;
  EXPECT_EQ(back.noise, config.noise);
  EXPECT_EQ(back.note, config.note);
  EXPECT_EQ(back.klt.min_distance_px, config.klt.min_distance_px);
  EXPECT_EQ(write_yaml(fields_of(back)), text);
}

TEST(Yaml, AnEnumIsOneOfItsNames) {
  SomeConfig config, back;
  ASSERT_TRUE(read_yaml("klt: {leaving: entropy}\n", "f.yaml", fields_of(config)));
  EXPECT_EQ(config.klt.leaving, Leaving::entropy);
  ASSERT_TRUE(read_yaml(write_yaml(fields_of(config)), "f.yaml", fields_of(back)));
  EXPECT_EQ(back.klt.leaving, Leaving::entropy);
  EXPECT_EQ(error_of("klt: {leaving: newest}\n"), "f.yaml:1: option 'klt.leaving': 'newest' is none of oldest|entropy");
  EXPECT_TRUE(validate(config));
  config.klt.leaving = static_cast<Leaving>(2);
  EXPECT_EQ(validate(config).error().message, "klt.leaving = 2 is none of oldest|entropy");
}

TEST(Yaml, TextThatLooksLikeAnotherTypeStaysText) {
  for (const char* note : {"true", "12", "~", "null", "", " ", "- x", "a: b", "2026-01-01"}) {
    SomeConfig config, back;
    config.note = note;
    ASSERT_TRUE(read_yaml(write_yaml(fields_of(config)), "f.yaml", fields_of(back))) << note;
    EXPECT_EQ(back.note, note);
  }
}

TEST(Yaml, EmptyFileAndEmptyGroupAreTheDefaults) {
  EXPECT_EQ(error_of(""), "");
  EXPECT_EQ(error_of("# only a comment\n"), "");
  EXPECT_EQ(error_of("klt:\n"), "");
}

TEST(Yaml, UnknownKeyNamesLineAndNearest) {
  EXPECT_EQ(error_of("frontend: klt\nklt:\n  max_featurs: 3\n"),
            "f.yaml:3: unknown option 'klt.max_featurs'; did you mean 'klt.max_features'?");
  EXPECT_EQ(error_of("\nmax_features: 30\n"), "f.yaml:2: unknown option 'max_features'; did you mean 'klt.max_features'?");
  EXPECT_EQ(error_of("zebra_crossing: 1\n"), "f.yaml:1: unknown option 'zebra_crossing'");
}

TEST(Yaml, WrongTypeNamesLineAndField) {
  EXPECT_EQ(error_of("klt:\n  max_features: many\n"), "f.yaml:2: option 'klt.max_features': 'many' is not a whole number");
  EXPECT_EQ(error_of("klt: {max_features: 20.5}\n"), "f.yaml:1: option 'klt.max_features': '20.5' is not a whole number");
  EXPECT_NE(error_of("klt: {subpixel: yes}\n"), "");
  EXPECT_NE(error_of("noise: .nan\n"), "");
  EXPECT_NE(error_of("noise: nan\n"), "");
  EXPECT_NE(error_of("noise: inf\n"), "");
  EXPECT_NE(error_of("noise: 0x10\n"), "");
  EXPECT_NE(error_of("noise: '0.1'\n"), "");
  EXPECT_NE(error_of("noise: [0.1]\n"), "");
  EXPECT_NE(error_of("noise:\n"), "");
  EXPECT_NE(error_of("klt: 3\n"), "");
  EXPECT_NE(error_of("frontend: surf\n"), "");
  EXPECT_NE(error_of("frontend: klt|orb\n"), "") << "the list of choices itself is no choice";
}

TEST(Yaml, RangeNamesLineFieldAndUnit) {
  EXPECT_EQ(error_of("klt:\n  subpixel: true\n  min_distance_px: 500\n"),
            "f.yaml:3: option 'klt.min_distance_px': 500 is outside [2, 200] px");
  EXPECT_NE(error_of("klt: {max_features: 99999999999}\n"), "");
}

TEST(Yaml, RepeatedKeyIsAnError) {
  EXPECT_EQ(error_of("noise: 0.1\nnoise: 0.2\n"), "f.yaml:2: 'noise' is there twice, first in line 1");
}

TEST(Yaml, BrokenTextIsAnErrorWithLine) {
  EXPECT_EQ(error_of("frontend: klt\nklt: [1, 2\n").substr(0, 7), "f.yaml:");
  EXPECT_EQ(error_of("- a\n- b\n"), "f.yaml:1: a configuration is a list of 'name: value' lines");
  EXPECT_NE(error_of("? [a]\n: b\n"), "");
  EXPECT_NE(error_of("a: &x\n  - *x\n"), "");
  EXPECT_NE(error_of(std::string("\0\xff\xfe", 3)), "");
}

TEST(Yaml, MissingFileIsAnError) {
  SomeConfig config;
  EXPECT_FALSE(read_yaml_file("no/such/file.yaml", fields_of(config)));
}

TEST(SetOption, SetsByPathAndExplainsMistakes) {
  SomeConfig config;
  const auto fields = fields_of(config);
  ASSERT_TRUE(set_option(fields, "klt.max_features=77"));
  EXPECT_EQ(config.klt.max_features, 77);
  ASSERT_TRUE(set_option(fields, "note=a=b"));
  EXPECT_EQ(config.note, "a=b");
  EXPECT_FALSE(set_option(fields, "klt.max_features"));
  EXPECT_FALSE(set_option(fields, "klt=3"));
  EXPECT_EQ(set_option(fields, "klt.max_feature=77").error().message,
            "unknown option 'klt.max_feature'; did you mean 'klt.max_features'?");
}

TEST(OptionFields, EveryFieldSaysWhatItIs) {
  SomeConfig config;
  for (const OptionField& field : fields_of(config)) {
    EXPECT_FALSE(field.meaning.empty()) << field.path;
    if (field.is_group()) continue;
    EXPECT_TRUE(field.set_from_text(field.value_text())) << field.path;
  }
}

}  // namespace yaml_test
}  // namespace fbvins
