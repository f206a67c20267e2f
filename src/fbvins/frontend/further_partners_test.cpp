// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/further_partners.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/frontend/frontend_options.hpp"
#include "tests/support/test_wall.hpp"

namespace fbvins {
namespace further_partners_test {

constexpr double kThird_m = 0.3;

/// The wall's pair, and a third camera beside it.
StereoRig three() {
  StereoRig rig = TestWall{}.rig();
  rig.cameras.push_back({rig.left(), {Quat::Identity(), Vec3(kThird_m, 0, 0)}});
  return rig;
}

StereoFrame frame(int k) {
  static const TestWall wall;
  StereoFrame out{Time{50'000'000LL * k}};
  const double at_m[] = {0, TestWall::kBaseline_m, kThird_m};
  for (int c = 0; c < 3; ++c) out.set_image(c, wall.render(0.01 * k + at_m[c], static_cast<std::uint64_t>(3 * k + c)));
  return out;
}

class FurtherPartnersOf : public testing::TestWithParam<const char*> {
 protected:
  TrackedFrame process(const StereoFrame& frame) {
    SensorPacket packet{FrameId{k_}, frame, {}};
    for (int i = 0; k_ > 0 && i <= 10; ++i)
      packet.imu.samples.push_back({Time{frame.t.ns - 50'000'000 + 5'000'000 * i}, Vec3::Zero(), Vec3(0, 0, 9.81)});
    ++k_;
    return frontend_->process(packet, {});
  }
  /// How many features the camera that is the `lead` follows, and each camera sees of them.
  static std::array<int, 3> of_lead(const TrackedFrame& frame, int lead) {
    std::array<int, 3> out{};
    for (const TrackedFeature& f : frame.features)
      for (const Observation& o : f.seen) out[static_cast<std::size_t>(o.camera)] += f.lead == lead;
    return out;
  }

 private:
  std::unique_ptr<Frontend> frontend_ = std::move(*make_frontend(three(), GetParam()));
  int k_ = 0;
};

TEST_P(FurtherPartnersOf, EveryCameraThatOverlapsSeesTheFeaturesWhereTheyAre) {
  for (int k = 0; k < 4; ++k) {
    const TrackedFrame tracked = process(frame(k));
    for (const int lead : {0, 2}) {
      const std::array<int, 3> seen = of_lead(tracked, lead);
      for (const int n : seen) EXPECT_GT(n, 0.6 * seen[static_cast<std::size_t>(lead)]) << k << " " << lead;
    }
    for (const TrackedFeature& f : tracked.features)
      for (const Observation& o : f.seen) {
        const double apart_m = three().T_BC(o.camera).p.x() - three().T_BC(f.lead).p.x();
        EXPECT_LT((f.seen.front().normalised - o.normalised - Vec2(apart_m / TestWall::kDepth_m, 0)).norm(), 1.0 / 200);
        EXPECT_LT((o.sqrt_information - f.seen.front().sqrt_information).norm(), 1e-6);
      }
    EXPECT_EQ(tracked.stats.stereo, std::ranges::count_if(tracked.features, &TrackedFeature::by_several));
  }
}

TEST_P(FurtherPartnersOf, ImagesThatDidNotComeOrAreOfAnotherTimeAreLeftOut) {
  (void)process(frame(0));
  StereoFrame without = frame(1), apart = frame(2);
  without.images.pop_back();
  EXPECT_EQ(of_lead(process(without), 0)[2], 0);
  apart.offsets.set(2, Duration{2'000'000});
  EXPECT_EQ(of_lead(process(apart), 0)[2], 0);
  EXPECT_GT(of_lead(process(frame(3)), 0)[2], 20);
}

INSTANTIATE_TEST_SUITE_P(All, FurtherPartnersOf, testing::Values("klt", "orb"));

}  // namespace further_partners_test
}  // namespace fbvins
