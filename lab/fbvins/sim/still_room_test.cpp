// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/still_room.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/angle.hpp"

namespace fbvins {
namespace still_room_test {

SimulationOptions short_flight() {
  SimulationOptions options = *simulation_preset("normal");
  options.flight.duration_s = 5;
  options.camera.time_samples = 1;
  options.world.tangles_per_m2 = 0;
  return options;
}

double difference(const Image& a, const Image& b) {
  double sum = 0;
  for (int i = 0; i < 752 * 480; ++i) sum += std::abs(a.row(0)[i] - b.row(0)[i]);
  return sum / (752 * 480);
}

TEST(StillRoom, TheSameChangeGivesTheSameImageAndAnotherAnother) {
  const auto room = StillRoom::build(short_flight(), 2);
  ASSERT_TRUE(room) << room.error().message;
  const std::vector<Pose<W, B>> view = {room->views()[1]};
  const auto left = [&](const RoomChange& change) { return room->render(view, change)[0].frame.left(); };
  const auto before = left({});
  EXPECT_EQ(difference(*before, *left({})), 0);
  EXPECT_GT(difference(*before, *left({.lamps = LampChange::sun})), 5);
  EXPECT_GT(difference(*before, *left({.moved_share = 1})), 1);
}

TEST(StillRoom, ATurnedViewLooksAtTheSamePoint) {
  const auto room = StillRoom::build(short_flight(), 0.5);
  ASSERT_TRUE(room) << room.error().message;
  const StereoRig& rig = room->rig();
  int turned = 0;
  for (const Pose<W, B>& view : room->views())
    if (const auto other = room->seen_from(view, {.turned_deg = 40})) {
      const Pose<W, C0> a = view * rig.T_BC0(), b = *other * rig.T_BC0();
      const Vec3 axis_a = a.q * Vec3::UnitZ(), axis_b = b.q * Vec3::UnitZ();
      const Vec3 ahead = a.p + 2.5 * Vec3(axis_a.x(), axis_a.y(), 0).normalized();
      EXPECT_NEAR((b.p + 2.5 * Vec3(axis_b.x(), axis_b.y(), 0).normalized() - ahead).norm(), 0, 1e-6);
      EXPECT_NEAR(so3_log((a.q.conjugate() * b.q).normalized()).norm(), 40 * kDegree, 1e-6);
      ++turned;
    }
  EXPECT_GT(turned, 0);
  EXPECT_FALSE(room->seen_from(room->views()[0], {.higher_m = 20}));
}

}  // namespace still_room_test
}  // namespace fbvins
