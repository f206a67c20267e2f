// SPDX-License-Identifier: Apache-2.0
#include "apps/first_look.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace fbvins::app {
namespace first_look_test {

struct Counted final : SensorInput {
  int readings = 0, frames = 0;
  void push(const ImuSample&) override { ++readings; }
  void push(StereoFrame) override { ++frames; }
};

StereoRig rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{.fx = 300, .fy = 300, .cx = 240, .cy = 160}, 480, 320), {}});
  rig.cameras[1].T_BC = Pose<B, C0>(Quat::Identity(), Vec3(0.12, 0, 0));
  return rig;
}

ImuSample reading(int k, double step_s = 0.005) {
  return {Time{1'000'000'000} + Duration::from_seconds(k * step_s), Vec3(0.01, 0.02 + 1e-4 * (k % 7), 0),
          Vec3(0.1, 0, 9.8 + 1e-3 * (k % 5))};
}

std::vector<FindingKind> found(const std::function<ImuSample(int)>& readings, FirstLook::Clock::duration longest, Counted& next) {
  std::vector<FindingKind> kinds;
  {
    FirstLook look(
        next, rig(), [&](const Finding& finding) { kinds.push_back(finding.kind); }, longest);
    for (int k = 0; k < 1400; ++k) {
      look.push(readings(k));
      if (k % 10 == 0) look.push(StereoFrame{readings(k).t});
    }
  }
  return kinds;
}

TEST(FirstLook, HandsOnEverythingAndIsSilentWhereAllIsWell) {
  Counted next;
  EXPECT_TRUE(found([](int k) { return reading(k); }, std::chrono::hours(1), next).empty());
  EXPECT_EQ(next.readings, 1400);
  EXPECT_EQ(next.frames, 140);
}

TEST(FirstLook, NamesAWrongUnitAfterFiveSeconds) {
  Counted next;
  const auto kinds = found(
      [](int k) {
        ImuSample sample = reading(k);
        sample.accel_mps2 /= 9.80665;
        return sample;
      },
      std::chrono::hours(1), next);
  EXPECT_EQ(kinds, std::vector{FindingKind::accel_units});
}

TEST(FirstLook, DoesNotWaitForStampsThatHardlyMove) {
  Counted next;
  const auto kinds = found(
      [](int k) {
        if (k == 100) std::this_thread::sleep_for(std::chrono::milliseconds(30));
        return reading(k, 5e-6);  // microseconds taken for nanoseconds
      },
      std::chrono::milliseconds(20), next);
  EXPECT_EQ(kinds, std::vector{FindingKind::imu_stamps});
}

}  // namespace first_look_test
}  // namespace fbvins::app
