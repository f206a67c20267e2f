// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/either_camera.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "fbvins/frontend/frontend_options.hpp"
#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace either_camera_test {

constexpr double kSpeed_mps = 0.2, kPeriod_s = 0.05;

double x_m(int k) { return kSpeed_mps * kPeriod_s * k; }

SensorPacket packet(int k, bool left, bool right) {
  static const TestWall wall;
  SensorPacket p;
  p.id = FrameId{k};
  p.frame.t = Time{50'000'000LL * k};
  if (left) p.frame.set_image(0, wall.render(x_m(k), static_cast<std::uint64_t>(2 * k)));
  if (right) p.frame.set_image(1, wall.render(x_m(k) + TestWall::kBaseline_m, static_cast<std::uint64_t>(2 * k + 1)));
  for (int i = 0; k > 0 && i <= 10; ++i)
    p.imu.samples.push_back({Time{p.frame.t.ns - 50'000'000 + 5'000'000 * i}, Vec3::Zero(), Vec3(0, 0, 9.81)});
  return p;
}

/// Where a feature is on the wall, m, as either camera sees it.
Vec2 on_wall(int k, const TrackedFeature& f) {
  const Vec2 seen = f.left() ? f.left()->normalised : f.right()->normalised;
  return Vec2(x_m(k) + (f.left() ? 0 : TestWall::kBaseline_m), 0) + TestWall::kDepth_m * seen;
}

int shared(const TrackedFrame& a, const TrackedFrame& b) {
  std::set<TrackId> ids;
  for (const TrackedFeature& f : a.features) ids.insert(f.id);
  int n = 0;
  for (const TrackedFeature& f : b.features) n += static_cast<int>(ids.count(f.id));
  return n;
}

int with_both(const TrackedFrame& frame) {
  int n = 0;
  for (const TrackedFeature& f : frame.features) n += f.by_several();
  return n;
}

class EitherCameraOf : public testing::TestWithParam<const char*> {
 protected:
  EitherCameraOf() : frontend_(*make_frontend(TestWall{}.rig(), GetParam())) {}

  /// Every feature is seen by a camera whose image came, once, and each track stays where it began on the wall.
  TrackedFrame process(int k, bool left, bool right) {
    TrackedFrame frame = frontend_->process(packet(k, left, right), {});
    EXPECT_EQ(frame.has(0), left);
    EXPECT_EQ(frame.has(1), right);
    std::set<TrackId> ids;
    int strayed = 0;
    for (const TrackedFeature& f : frame.features) {
      EXPECT_TRUE(ids.insert(f.id).second) << "twice in frame " << k;
      EXPECT_FALSE(f.seen.empty());
      EXPECT_TRUE(left || !f.left());
      EXPECT_TRUE(right || !f.right());
      const Vec2 place = on_wall(k, f);
      strayed += (place - places_.try_emplace(f.id, place).first->second).norm() > 0.03;  // 2 px
    }
    EXPECT_LE(strayed, 2) << "of " << frame.features.size() << " in frame " << k;
    return frame;
  }
  TrackedFrame process(int from, int to, bool left, bool right) {
    TrackedFrame frame;
    for (int k = from; k < to; ++k) frame = process(k, left, right);
    return frame;
  }

 private:
  std::unique_ptr<Frontend> frontend_;
  std::map<TrackId, Vec2> places_;
};
INSTANTIATE_TEST_SUITE_P(Frontends, EitherCameraOf, testing::Values("klt", "orb", "boost"));

TEST_P(EitherCameraOf, TheRightCameraGoesOnWithTheTracks) {
  const TrackedFrame before = process(0, 10, true, true);
  const TrackedFrame first = process(10, false, true);
  EXPECT_GT(shared(before, first), 0.7 * with_both(before));
  EXPECT_EQ(first.stats.stereo, 0);
  const TrackedFrame later = process(11, 60, false, true);
  EXPECT_GT(later.features.size(), 0.6 * static_cast<double>(before.features.size()));  // new ones, too
}

TEST_P(EitherCameraOf, TheLeftCameraTakesTheLeadBackAfterALongGap) {
  process(0, 10, true, true);
  const TrackedFrame alone = process(10, 50, false, true);
  const TrackedFrame both = process(50, true, true);
  EXPECT_GT(shared(alone, both), 0.7 * static_cast<double>(alone.features.size()));
  EXPECT_GT(with_both(both), 20);
  const TrackedFrame left_leads = process(51, true, true);
  EXPECT_GT(shared(both, left_leads), 0.7 * with_both(both));
  EXPECT_GT(process(52, 60, true, false).features.size(), 20u);
}

TEST_P(EitherCameraOf, OneLeftImageMissingCostsNoTrack) {
  const TrackedFrame before = process(0, 10, true, true);
  EXPECT_GT(process(10, false, true).features.size(), 20u);
  const TrackedFrame after = process(11, true, true);
  EXPECT_GT(shared(before, after), 0.85 * static_cast<double>(before.features.size()));
}

TEST_P(EitherCameraOf, CamerasMayTakeTurns) {
  process(0, 5, true, true);
  for (int k = 5; k < 40; ++k) process(k, k % 3 != 0, k % 3 != 1);
  EXPECT_GT(with_both(process(40, 42, true, true)), 20);
}

TEST_P(EitherCameraOf, TheRightCameraAloneFromTheBeginning) {
  EXPECT_GT(process(0, 5, false, true).features.size(), 20u);
  process(5, 8, false, false);
  EXPECT_GT(with_both(process(8, 11, true, true)), 20);
}

}  // namespace either_camera_test
}  // namespace fbvins
