// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/tag_finder.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <memory>

#include "fbvins/calibration/board_image.hpp"
#include "fbvins/calibration/simulated_board.hpp"

namespace fbvins {
namespace tag_finder_test {

#ifdef FBVINS_WITH_APRILTAG

const Board kTag{.columns = 1, .rows = 1, .size_m = 0.2, .spacing = 0.3};

StereoRig rig() {
  StereoRig out;
  out.cameras.assign(2, {example_cameras()[0], {}});
  out.cameras[0].T_BC = {so3_exp(Vec3(-1.2, 1.2, -1.2)), Vec3(0.05, 0.06, -0.01)};
  return out;
}

TagSurvey survey() { return {.size_m = 0.2, .T_AT = {{0, {upright_facing(1), Vec3(3, 2, 1.5)}}}}; }

StereoFrame image_of(const Pose<C0, T>& T_C0T, std::uint64_t seed) {
  Rng rng(seed);
  const BoardCamera renderer(example_cameras()[0], *BoardPattern::create(kTag));
  const Pose<Cn, T> T_CnT(T_C0T.q, T_C0T.p);
  return {Time{77}, {std::make_shared<Image>(renderer.render({T_CnT}, {}, rng))}};
}

/// The tag `distance_m` ahead, turned by an angle from facing the camera.
Pose<C0, T> ahead(double distance_m, double turned_rad, const Vec3& axis) {
  const Quat q = so3_exp(turned_rad * axis) * Quat(0, 1, 0, 0);
  return {q, Vec3(Vec3(0.1, -0.05, distance_m) - q * Vec3(0.1, 0.1, 0))};
}

TEST(TagFinder, PosesAreAsCertainAsTheySay) {
  TagFinder finder = *TagFinder::create(rig(), survey());
  double nees = 0;
  int found = 0;
  std::uint64_t seed = 1;
  for (const double distance_m : {0.9, 1.6, 2.4})
    for (const double turned : {0.0, 0.15, 0.5, 0.9}) {
      const Pose<C0, T> T_CT = ahead(distance_m, turned, Vec3(0.6, 0.8, 0));
      const std::vector<TagAnchor> tags = finder.find(image_of(T_CT, seed++));
      if (tags.empty()) continue;
      ASSERT_EQ(tags.size(), 1u);
      EXPECT_EQ(tags[0].t, Time{77});
      const Pose<B, Tag> truth = rig().T_BC0() * Pose<C0, Tag>(T_CT.q, T_CT * Vec3(0.1, 0.1, 0));
      Vec6 e;
      e << tags[0].T_BT.p - truth.p, so3_log(truth.q.conjugate() * tags[0].T_BT.q);
      const double size = e.dot(tags[0].covariance.inverse() * e);
      EXPECT_LT(size, 25) << distance_m << " m, " << turned << " rad";
      EXPECT_LT(e.head<3>().norm(), 0.02 * distance_m);
      nees += size, ++found;
    }
  EXPECT_GE(found, 5) << "the squares of a grid touch the tag and hide some";
  EXPECT_LT(nees / found, 6) << "the simulated corners are better than those of a real lens";
  EXPECT_GT(nees / found, 0.02);
}

TEST(TagFinder, WhatTheSurveyDoesNotHaveIsLeftOut) {
  TagSurvey other = survey();
  other.T_AT = {{5, {}}};
  TagFinder finder = *TagFinder::create(rig(), other);
  EXPECT_TRUE(finder.find(image_of(ahead(1, 0.3, Vec3::UnitY()), 1)).empty());
  EXPECT_TRUE(finder.find({}).empty());
}

/// Keeps what it is given.
struct Receiver final : Mapper {
  MapUpdate process(const Keyframe& keyframe) override {
    anchors = keyframe.anchors;
    return {};
  }
  std::vector<Anchor> anchors;
};

TEST(TagMapper, AddsTheTagsToTheAnchorsOfAKeyframe) {
  Receiver receiver;
  TagMapper mapper(*TagFinder::create(rig(), survey()), receiver);
  Keyframe keyframe;
  keyframe.anchors = {HeightAnchor{}};
  keyframe.images = image_of(ahead(1, 0.3, Vec3::UnitY()), 1);
  (void)mapper.process(keyframe);
  ASSERT_EQ(receiver.anchors.size(), 2u);
  EXPECT_EQ(std::get<TagAnchor>(receiver.anchors[1]).id, 0);
  EXPECT_EQ(std::get<TagAnchor>(receiver.anchors[1]).T_AT.p, Vec3(3, 2, 1.5));
  keyframe.images = {};
  (void)mapper.process(keyframe);
  EXPECT_EQ(receiver.anchors.size(), 1u);
}

#else

TEST(TagFinder, ABuildWithoutTheLibrarySaysSo) {
  EXPECT_NE(TagFinder::create({}, {}).error().message.find("libapriltag"), std::string::npos);
}

#endif

}  // namespace tag_finder_test
}  // namespace fbvins
