// SPDX-License-Identifier: Apache-2.0
#include "fbvins/boards/hung_tags.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "fbvins/calibration/tag_finder.hpp"

namespace fbvins {
namespace hung_tags_test {

#ifdef FBVINS_WITH_APRILTAG

TEST(HungTags, AreFoundInRenderedImagesWhereTheyHang) {
  SimulationOptions options = *simulation_preset("normal");
  options.flight.duration_s = 20;
  options.image_rate_hz = 2;
  Result<TagSurvey> survey = TagSurvey{};
  Result<Simulation> simulation =
      prepare_simulation(options, [&](World& world, const Simulation& s) { survey = hang_tags(world, s, 2, 0.25); });
  ASSERT_TRUE(simulation) << simulation.error().message;
  ASSERT_TRUE(survey) << survey.error().message;
  ASSERT_EQ(survey->T_AT.size(), 2u);
  TagFinder finder = *TagFinder::create(simulation->rig, *survey);
  int found = 0;
  double nees = 0;
  for (std::size_t i = 0; i < simulation->frames.size(); ++i) {
    const RenderedFrame rendered = render_frame(*simulation, i);
    const Pose<W, B> truth = simulation->flight.pose((simulation->frames[i] - simulation->start).seconds());
    for (const TagAnchor& tag : finder.find(rendered.frame)) {
      const Pose<B, Tag> expected = truth.inverse() * tag.T_AT.cast_frames<W, Tag>();
      Vec6 e;
      e << tag.T_BT.p - expected.p, so3_log(expected.q.conjugate() * tag.T_BT.q);
      nees += e.dot(tag.covariance.inverse() * e), ++found;
      EXPECT_LT((tag.T_BT.p - expected.p).norm(), 0.05 * expected.p.norm());
    }
  }
  EXPECT_GT(found, 4);
  EXPECT_LT(nees / found, 12) << "6 where consistent";
}

TEST(HungTags, WhereNoneCanBeSeenIsSaid) {
  SimulationOptions options = *simulation_preset("normal");
  options.flight.duration_s = 3;
  Result<TagSurvey> survey = TagSurvey{};
  ASSERT_TRUE(prepare_simulation(options, [&](World& world, const Simulation& s) { survey = hang_tags(world, s, 20, 0.05); }));
  ASSERT_FALSE(survey);
  EXPECT_NE(survey.error().message.find("tags of 0.05 m, not 20"), std::string::npos);
}

#endif

}  // namespace hung_tags_test
}  // namespace fbvins
