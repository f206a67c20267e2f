// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/tag_survey.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace tag_survey_test {

constexpr const char* kHead = "family: tag36h11\nsize_m: 0.16\ntags:\n";

TEST(TagSurvey, TagsOnWallsAndElsewhere) {
  const auto survey = parse_tags(std::string(kHead) +
                                     "  - {id: 3, position_m: [4, 1.2, 1.6], facing_deg: 180}\n"
                                     "  - {id: 7, position_m: [2, 2, 0], orientation_wxyz: [1, 0, 0, 0]}\n"
                                     "  - {id: 9}\n",
                                 "tags.yaml");
  ASSERT_TRUE(survey) << survey.error().message;
  EXPECT_EQ(survey->size_m, 0.16);
  ASSERT_EQ(survey->T_AT.size(), 3u);
  const auto has_place = [](const Pose<A, Tag>& T_AT) { return TagAnchor{.T_AT = T_AT}.has_place(); };
  EXPECT_TRUE(has_place(survey->T_AT.at(3)));
  EXPECT_FALSE(has_place(survey->T_AT.at(9)));
  const Pose<A, Tag>& wall = survey->T_AT.at(3);
  EXPECT_LT((wall.q * Vec3::UnitZ() + Vec3::UnitX()).norm(), 1e-12) << "its face looks along -x";
  EXPECT_LT((wall.q * Vec3::UnitY() - Vec3::UnitZ()).norm(), 1e-12) << "upright";
  EXPECT_LT((wall.q * Vec3::UnitX() + Vec3::UnitY()).norm(), 1e-12) << "who looks along x has -y to his right";
  const auto again = parse_tags(tags_to_yaml(*survey), "tags.yaml");
  ASSERT_TRUE(again) << again.error().message;
  for (const auto& [id, T] : survey->T_AT) {
    ASSERT_EQ(has_place(again->T_AT.at(id)), has_place(T));
    if (!has_place(T)) continue;
    EXPECT_LT((again->T_AT.at(id).p - T.p).norm(), 1e-12);
    EXPECT_LT(so3_log(again->T_AT.at(id).q.conjugate() * T.q).norm(), 1e-9);
  }
}

TEST(TagSurvey, EveryFaultIsASentenceWithItsLine) {
  const auto complaint = [](const std::string& text) {
    const auto survey = parse_tags(text, "t.yaml");
    return survey ? std::string("none") : survey.error().message;
  };
  const auto of_tag = [&](const std::string& fields) { return complaint(std::string(kHead) + "  - " + fields + "\n"); };
  EXPECT_NE(complaint("family: tag25h9\nsize_m: 0.1\ntags: []\n").find("t.yaml:1"), std::string::npos);
  EXPECT_NE(complaint("family: tag36h11\nsize_m: 160\ntags: []\n").find("metres"), std::string::npos);
  EXPECT_NE(complaint("family: tag36h11\nsize_m: 0.16\n").find("tags"), std::string::npos);
  EXPECT_NE(complaint("family: tag36h11\nsize_m: 0.16\ntags: []\n").find("list"), std::string::npos);
  EXPECT_NE(of_tag("{id: 3, position_m: [1, 2], facing_deg: 0}").find("t.yaml:4"), std::string::npos);
  EXPECT_NE(of_tag("{id: 3, position_m: [1, 2, 3]}").find("either"), std::string::npos);
  EXPECT_NE(of_tag("{id: 3, position_m: [1, 2, 3], facing_deg: 0, orientation_wxyz: [1, 0, 0, 0]}").find("either"),
            std::string::npos);
  EXPECT_NE(of_tag("{id: 3, position_m: [1, 2, 3], orientation_wxyz: [1, 1, 0, 0]}").find("length"), std::string::npos);
  EXPECT_NE(of_tag("{id: 587, position_m: [1, 2, 3], facing_deg: 0}").find("587"), std::string::npos);
  EXPECT_NE(of_tag("{id: 3, position_m: [1, 2, 3], facing_deg: 0, tilt: 1}").find("tilt"), std::string::npos);
  EXPECT_NE(of_tag("5").find("list of fields"), std::string::npos);
  EXPECT_NE(
      of_tag("{id: 3, position_m: [1, 2, 3], facing_deg: 0}\n  - {id: 3, position_m: [1, 2, 3], facing_deg: 0}").find("twice"),
      std::string::npos);
  EXPECT_FALSE(load_tags("/nonexistent/tags.yaml"));
}

}  // namespace tag_survey_test
}  // namespace fbvins
