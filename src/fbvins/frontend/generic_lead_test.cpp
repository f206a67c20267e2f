// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/generic_lead.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "fbvins/frontend/observe.hpp"

namespace fbvins {
namespace generic_lead_test {

Camera camera() { return Camera(PinholeRadtan{.fx = 200, .fy = 200, .cx = 160, .cy = 120}, 320, 240); }

StereoRig pair() {
  StereoRig rig;
  rig.cameras.assign(2, {camera(), {}});
  rig.cameras[1].T_BC = Pose<B, C0>(Quat::Identity(), Vec3(0.11, 0, 0));
  return rig;
}

/// Follows one feature in the left image under number 0, and gives each image one more that is new.
struct Counting final : Frontend {
  explicit Counting(const StereoRig& rig, std::vector<LandmarkUpdate>* updates = nullptr) : camera(rig.left()), told(updates) {}
  TrackedFrame process(const SensorPacket& packet, const StatePrior&) override {
    TrackedFrame out;
    if (!packet.frame.left()) return out;
    out.features.resize(2);
    out.features[0].id = TrackId{0}, out.features[1].id = TrackId{next++};
    out.features[0].see(0, observe(camera, Vec2(50, 60), 1.0));
    out.features[1].see(0, observe(camera, Vec2(150, 60), 1.0));
    return out;
  }
  void locate(const LandmarkUpdate& update) override {
    if (told != nullptr) told->push_back(update);
  }
  Camera camera;
  std::vector<LandmarkUpdate>* told;
  std::int64_t next = 1;
};

SensorPacket packet(int k, bool left, bool right) {
  SensorPacket out;
  out.id = FrameId{k};
  out.frame.t = Time{50'000'000LL * k};
  if (left) out.frame.set_image(0, std::make_shared<const Image>(320, 240, std::uint8_t{90}));
  if (right) out.frame.set_image(1, std::make_shared<const Image>(320, 240, std::uint8_t{90}));
  return out;
}

TEST(GenericLead, ACameraThatFailsIsReplacedByTheOtherOneWithNewTracks) {
  auto frontend = for_any_rig(pair(), 100, [](const StereoRig& rig) { return std::make_unique<Counting>(rig); });
  std::set<TrackId> of_left, of_right;
  for (int k = 0; k < 5; ++k)
    for (const TrackedFeature& f : frontend->process(packet(k, true, true), {}).features) of_left.insert(f.id);
  for (int k = 5; k < 25; ++k) {
    const TrackedFrame frame = frontend->process(packet(k, false, true), {});
    EXPECT_FALSE(frame.has(0));
    EXPECT_TRUE(frame.has(1));
    ASSERT_EQ(frame.features.size(), 2U);
    for (const TrackedFeature& f : frame.features) {
      EXPECT_FALSE(f.left());
      EXPECT_TRUE(f.right());
      of_right.insert(f.id);
    }
  }
  EXPECT_EQ(of_left.size(), 6U);
  EXPECT_EQ(of_right.size(), 21U);
  for (const TrackId id : of_right) EXPECT_FALSE(of_left.count(id)) << "another's number";
}

TEST(GenericLead, AfterOneMissingImageTheTracksGoOnAndNewOnesHaveNewNumbers) {
  auto frontend = for_any_rig(pair(), 100, [](const StereoRig& rig) { return std::make_unique<Counting>(rig); });
  const TrackId followed = frontend->process(packet(0, true, true), {}).features[0].id;
  std::set<TrackId> others = {frontend->process(packet(1, true, true), {}).features[1].id};
  for (const TrackedFeature& f : frontend->process(packet(2, false, true), {}).features) others.insert(f.id);
  const TrackedFrame back = frontend->process(packet(3, true, true), {});
  ASSERT_EQ(back.features.size(), 2U);
  EXPECT_EQ(back.features[0].id, followed);
  EXPECT_FALSE(others.count(back.features[1].id));
}

TEST(GenericLead, PositionsComeUnderTheFrontendsOwnNumbers) {
  std::vector<LandmarkUpdate> told;
  GenericLead lead(pair(), [&told](const StereoRig& rig) { return std::make_unique<Counting>(rig, &told); });
  lead.begin_ids_at(40);
  const TrackedFrame frame = lead.process(packet(0, true, true), {});
  lead.begin_ids_at(90);
  const TrackedFrame later = lead.process(packet(1, true, true), {});
  EXPECT_EQ(later.features[0].id, frame.features[0].id);
  EXPECT_EQ(later.features[1].id, TrackId{90});
  lead.locate({3, 0, {{later.features[1].id, Vec3(1, 2, 3)}, {frame.features[1].id, Vec3::Zero()}, {TrackId{7}, Vec3::Zero()}}});
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].sequence, 3);
  ASSERT_EQ(told[0].landmarks.size(), 2U) << "7 is another's";
  EXPECT_EQ(told[0].landmarks[0].track, TrackId{2});
  EXPECT_EQ(told[0].landmarks[1].track, TrackId{1});
}

TEST(GenericLead, WhatAMaskHidesOrIsNoNumberIsLeftOut) {
  struct Spoilt final : Frontend {
    TrackedFrame process(const SensorPacket&, const StatePrior&) override {
      TrackedFrame out;
      for (const double u : {20.0, 200.0, std::numeric_limits<double>::quiet_NaN()}) {
        Observation seen = *observe(camera(), Vec2(200, 100), 1.0);
        seen.pixel.x() = u;
        out.features.push_back({TrackId{static_cast<std::int64_t>(out.features.size())}});
        out.features.back().see(0, seen);
      }
      out.features.push_back({TrackId{9}});
      out.features.push_back({TrackId{10}});
      out.features.back().see(5, observe(camera(), Vec2(200, 100), 1.0));  // no camera of the pair
      return out;
    }
  };
  StereoRig rig = pair();
  Image hidden(320, 240, std::uint8_t{255});
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 100; ++u) hidden.at(u, v) = 0;
  rig.cameras[0].camera.set_mask(std::make_shared<const Mask>(hidden));
  GenericLead lead(rig, [](const StereoRig&) { return std::make_unique<Spoilt>(); });
  const TrackedFrame frame = lead.process(packet(0, true, true), {});
  ASSERT_EQ(frame.features.size(), 1U);
  EXPECT_EQ(frame.features[0].left()->pixel.x(), 200);
}

}  // namespace generic_lead_test
}  // namespace fbvins
