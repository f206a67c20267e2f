// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/range_model.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace fbvins {
namespace range_model_test {

/// A floor of ten metres and a table of one metre, 0.7 m high, above its middle.
std::vector<Facet> floor_and_table() {
  Facet floor, table;
  floor.corner = Vec3(-5, -5, 0), floor.u = Vec3(10, 0, 0), floor.v = Vec3(0, 10, 0);
  table.corner = Vec3(-0.5, -0.5, 0.7), table.u = Vec3(1, 0, 0), table.v = Vec3(0, 1, 0);
  return {floor, table};
}

TEST(RangeModel, IsTheDistanceToTheNearestSurfaceAlongTheBeam) {
  const auto facets = floor_and_table();
  EXPECT_NEAR(distance_to(facets, Vec3(0, 0, 2), -Vec3::UnitZ()), 1.3, 1e-12);
  EXPECT_NEAR(distance_to(facets, Vec3(2, 0, 2), -Vec3::UnitZ()), 2, 1e-12);
  EXPECT_NEAR(distance_to(facets, Vec3(2, 0, 2), Vec3(0.6, 0, -0.8)), 2.5, 1e-12);
}

TEST(RangeModel, SeesNothingBesideUpwardsAndFromBelow) {
  const auto facets = floor_and_table();
  EXPECT_TRUE(std::isinf(distance_to(facets, Vec3(20, 0, 2), -Vec3::UnitZ())));
  EXPECT_TRUE(std::isinf(distance_to(facets, Vec3(0, 0, 2), Vec3::UnitZ())));
  EXPECT_TRUE(std::isinf(distance_to(facets, Vec3(0, 0, 0.5), Vec3::UnitZ()))) << "the table's lower side has no surface";
}

}  // namespace range_model_test
}  // namespace fbvins
