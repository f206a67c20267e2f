// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/rig_frontend.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "fbvins/frontend/frontend_options.hpp"
#include "fbvins/geometry/so3.hpp"
#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace rig_frontend_test {

double x_m(int k) { return 0.01 * k; }

/// The wall's pair, and another one that looks backwards at a wall like it: cameras 2 and 3.
StereoRig two_pairs() {
  StereoRig rig = TestWall{}.rig();
  const Pose<B, B> turned(so3_exp(Vec3(0, std::numbers::pi, 0)), Vec3::Zero());
  rig.cameras.insert(rig.cameras.end(),
                     {{rig.left(), turned * rig.T_BC0()}, {rig.right(), turned * rig.T_BC1().cast_frames<B, C0>()}});
  return rig;
}

/// `back`: whether the images of cameras 2 and 3 come.
SensorPacket packet(int k, bool front = true, bool back = true) {
  static const TestWall wall;
  const auto at = [](double x, std::uint64_t seed) { return wall.render(x, seed); };
  const auto seed = static_cast<std::uint64_t>(4 * k);
  SensorPacket p;
  p.id = FrameId{k};
  p.frame.t = Time{50'000'000LL * k};
  if (front) p.frame.images = {at(x_m(k), seed), at(x_m(k) + TestWall::kBaseline_m, seed + 1)};
  if (back) p.frame.set_image(2, at(-x_m(k), seed + 2)), p.frame.set_image(3, at(-x_m(k) + TestWall::kBaseline_m, seed + 3));
  for (int i = 0; k > 0 && i <= 10; ++i)
    p.imu.samples.push_back({Time{p.frame.t.ns - 50'000'000 + 5'000'000 * i}, Vec3::Zero(), Vec3(0, 0, 9.81)});
  return p;
}

std::map<int, int> features_by_camera(const TrackedFrame& frame) {
  std::map<int, int> count;
  for (const TrackedFeature& f : frame.features)
    for (const Observation& o : f.seen) ++count[o.camera];
  return count;
}

class RigFrontendOf : public testing::TestWithParam<const char*> {
 protected:
  RigFrontendOf() : frontend_(*make_frontend(two_pairs(), GetParam())) {}
  std::unique_ptr<Frontend> frontend_;
};

TEST_P(RigFrontendOf, EachPairHasItsFeatures) {
  std::map<TrackId, int> cameras;
  for (int k = 0; k < 6; ++k) {
    const TrackedFrame frame = frontend_->process(packet(k), {});
    EXPECT_EQ(frame.cameras, (std::vector<bool>{true, true, true, true}));
    std::map<int, int> count = features_by_camera(frame);
    for (int c = 0; c < 4; ++c) EXPECT_GT(count[c], 30) << "camera " << c << ", image " << k;
    for (const TrackedFeature& f : frame.features) {
      EXPECT_TRUE(f.lead == 0 || f.lead == 2);
      for (const Observation& o : f.seen) EXPECT_TRUE(o.camera == f.lead || o.camera == f.lead + 1);
      const auto [at, is_new] = cameras.try_emplace(f.id, f.lead);
      EXPECT_EQ(at->second, f.lead) << "a track has moved to another pair";
    }
    EXPECT_EQ(frame.stats.stereo, std::ranges::count_if(frame.features, &TrackedFeature::by_several));
  }
}

TEST_P(RigFrontendOf, APairWithoutImagesLeavesTheOtherAlone) {
  for (int k = 0; k < 3; ++k) (void)frontend_->process(packet(k), {});
  const TrackedFrame blind = frontend_->process(packet(3, false, true), {});
  EXPECT_EQ(blind.cameras, (std::vector<bool>{false, false, true, true}));
  std::map<int, int> count = features_by_camera(blind);
  EXPECT_EQ(count[0] + count[1], 0);
  EXPECT_GT(count[2], 30);
  EXPECT_GT(features_by_camera(frontend_->process(packet(4), {}))[0], 30);
}

TEST_P(RigFrontendOf, TheFeaturesOfABlindPairAreTheOthers) {
  FrontendOptions options;
  options.kind = GetParam();
  options.klt.max_features = options.orb.max_features = 60;
  const auto rig = *make_frontend(two_pairs(), options);
  const auto in_front = [&](int first, int last, bool back) {
    std::map<int, int> count;
    for (int k = first; k < last; ++k) count = features_by_camera(rig->process(packet(k, true, back), {}));
    return count[0];
  };
  EXPECT_NEAR(in_front(0, 4, true), 40, 4) << "two thirds of what a pair alone has";
  EXPECT_NEAR(in_front(4, 28, false), 60, 6) << "all of it";
  EXPECT_GT(features_by_camera(rig->process(packet(28), {}))[2], 25) << "the blind one takes its share as soon as it sees";
}

INSTANTIATE_TEST_SUITE_P(All, RigFrontendOf, testing::Values("klt", "orb"));

/// Keeps what it is told.
struct Listener final : Frontend {
  std::vector<LandmarkUpdate>* told;
  explicit Listener(std::vector<LandmarkUpdate>& updates) : told(&updates) {}
  TrackedFrame process(const SensorPacket& packet, const StatePrior&) override {
    TrackedFrame frame;
    frame.id = packet.id;
    TrackedFeature feature;
    feature.id = TrackId{7};
    feature.see(0, Observation{});
    frame.features = {feature};
    return frame;
  }
  void locate(const LandmarkUpdate& update) override { told->push_back(update); }
  void follow_at_most(int) override {}
};

TEST(RigFrontend, APositionGoesToTheFrontendOfItsTrack) {
  std::vector<LandmarkUpdate> told[2];
  std::vector<std::unique_ptr<Frontend>> frontends;
  for (auto& updates : told) frontends.push_back(std::make_unique<Listener>(updates));
  RigFrontend rig({{0, 1}, {2, 3}}, std::move(frontends), 150);
  const std::vector<TrackedFeature> features = rig.process({}, {}).features;
  ASSERT_EQ(features.size(), 2U);
  EXPECT_NE(features[0].id, features[1].id);
  rig.locate({5, 1, {{features[1].id, Vec3(1, 2, 3)}}});
  ASSERT_EQ(told[0].size(), 1U);  // none of its own, and no gap in the numbers
  EXPECT_TRUE(told[0][0].landmarks.empty());
  EXPECT_EQ(told[0][0].sequence, 5);
  ASSERT_EQ(told[1].size(), 1U);
  ASSERT_EQ(told[1][0].landmarks.size(), 1U);
  EXPECT_EQ(told[1][0].landmarks[0].track, TrackId{7});
}

}  // namespace rig_frontend_test
}  // namespace fbvins
