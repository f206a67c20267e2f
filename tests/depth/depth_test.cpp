// SPDX-License-Identifier: Apache-2.0
// A rendered flight of a camera with a depth sensor through a room with hardly any texture, and with images that show nothing for
// three seconds while the depths stay.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fbvins/config/config.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/doctor/diagnose.hpp"
#include "fbvins/doctor/doctor.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/pipeline/system.hpp"
#include "fbvins/sim/simulation.hpp"
#include "tests/support/rendered_recording.hpp"

namespace fbvins {
namespace depth_test {

constexpr double kBlankFrom_s = 2, kBlankTo_s = 5;

std::shared_ptr<const Image> plain(const Image& like, Rng& rng) {
  auto image = std::make_shared<Image>(like.width(), like.height());
  for (int y = 0; y < image->height(); ++y)
    for (int x = 0; x < image->width(); ++x) image->at(x, y) = static_cast<std::uint8_t>(130 + rng.normal());
  return image;
}

test::RenderedRecording record(double seconds, double apart_m) {
  SimulationOptions options = *simulation_preset("weak-texture");
  options.seed = 21;
  options.rig = "rgbd";
  options.depth.apart_m = apart_m;
  options.flight.duration_s = seconds;
  return test::rendered(options);
}

/// Rendered once.
const test::RenderedRecording& recorded() {
  static const test::RenderedRecording recorded = record(6, 0);
  return recorded;
}

struct Flown {
  std::vector<Odometry> poses;
  double seconds(std::size_t i) const { return (poses[i].t - poses.front().t).seconds(); }
  double ate_m(const test::RenderedRecording& recording = recorded(), Alignment alignment = Alignment::se3) const {
    Trajectory<W> estimate;
    for (const Odometry& o : poses)
      if (o.health.has_pose()) estimate.push_back({o.t, o.T_WB});
    const auto evaluation = evaluate(recording.truth, estimate, {.association = {}, .alignment = alignment});
    if (!evaluation) ADD_FAILURE() << evaluation.error().message;
    return evaluation ? evaluation->absolute_m.rmse : 1e9;
  }
  /// Of the position, by the covariance.
  double largest_sigma_m() const {
    double largest = 0;
    for (const Odometry& o : poses)
      if (o.health.has_pose()) largest = std::max(largest, std::sqrt(o.pose_covariance.topLeftCorner<3, 3>().trace()));
    return largest;
  }
};

/// `blank`: images show nothing for a while.
Flown fly(const std::string& frontend, bool blank, bool depth_meanwhile, const test::RenderedRecording& recording = recorded()) {
  Config config;
  config.frontend.kind = frontend;
  Result<System> system = System::create(config, recording.rig);
  EXPECT_TRUE(system.ok());
  Flown out;
  system->on_odometry([&](const Odometry& o) { out.poses.push_back(o); });
  Rng rng(1, 1);
  std::optional<Time> first;
  for (SensorEvent event : recording.events) {
    if (auto* frame = std::get_if<StereoFrame>(&event)) {
      if (!first) first = frame->t;
      const double at_s = (frame->t - *first).seconds();
      if (blank && at_s >= kBlankFrom_s && at_s < kBlankTo_s) {
        frame->set_image(0, plain(*frame->left(), rng));
        if (!depth_meanwhile) frame->depth = nullptr;
      }
    }
    EXPECT_TRUE(system->push(std::move(event)).ok());
  }
  EXPECT_TRUE(system->finish().ok());
  return out;
}

void expect_good_from_its_start_on(const Flown& flown) {
  const auto first = std::ranges::find_if(flown.poses, [](const Odometry& o) { return o.health.has_pose(); });
  ASSERT_NE(first, flown.poses.end());
  EXPECT_LT((first->t - flown.poses.front().t).seconds(), 1.0);
  for (auto o = first; o != flown.poses.end(); ++o) EXPECT_EQ(o->health.state, HealthState::good);
}

class DepthFlight : public testing::TestWithParam<const char*> {};

TEST_P(DepthFlight, IsGoodFromItsStartOn) {
  const Flown flown = fly(GetParam(), false, true);
  expect_good_from_its_start_on(flown);
  EXPECT_LT(flown.ate_m(), 0.015);
}

/// The doctor measures rotations with the sensor's depths.
TEST(DepthDoctor, FindsATimeOffset) {
  const Replay replay = [&](const TakeEvent& take) {
    for (const SensorEvent& event : recorded().events)
      if (!take(event)) break;
    return Result<void>{};
  };
  StereoRig rig = recorded().rig;
  rig.time_offset_s += 0.02;
  const auto late = diagnose(rig, replay, CalibrationStyle::euroc);
  ASSERT_TRUE(late);
  ASSERT_EQ(late->findings.size(), 1u) << to_text(*late, true);
  EXPECT_EQ(late->findings[0].kind, FindingKind::time_offset);
  EXPECT_NEAR(late->findings[0].size, -20, 2);
  EXPECT_TRUE(late->findings[0].corrected.starts_with("cam0/sensor.yaml: timeshift_cam_imu: ")) << "there is no cam1";
}

/// One camera alone cannot start at rest: the depths that it starts by are the sensor's, 5 cm away and of other pixels.
TEST(DepthElsewhere, IsGoodFromItsStartOn) {
  const test::RenderedRecording recording = record(3, 0.05);
  ASSERT_TRUE(recording.rig.depth->own);
  const Flown flown = fly("klt", false, true, recording);
  expect_good_from_its_start_on(flown);
  EXPECT_LT(flown.ate_m(recording, Alignment::yaw), 0.015);  // it climbs straight up
}

TEST_P(DepthFlight, DepthsCarryThePoseWhereImagesShowNothing) {
  const Flown with = fly(GetParam(), true, true), without = fly(GetParam(), true, false);
  bool degraded = false;
  for (std::size_t i = 0; i < with.poses.size(); ++i) {
    const Odometry& o = with.poses[i];
    EXPECT_NE(o.health.state, HealthState::lost);
    EXPECT_EQ(o.reset_counter, with.poses.back().reset_counter);
    if (with.seconds(i) > kBlankFrom_s + 0.2 && with.seconds(i) < kBlankTo_s) {
      EXPECT_EQ(o.health.state, HealthState::degraded);
      degraded = true;
    }
  }
  EXPECT_TRUE(degraded);
  EXPECT_EQ(with.poses.back().health.state, HealthState::good);
  EXPECT_LT(with.ate_m(), 0.02);
  EXPECT_LT(with.largest_sigma_m(), 0.3 * without.largest_sigma_m());
}

INSTANTIATE_TEST_SUITE_P(All, DepthFlight, testing::Values("klt", "boost"));

}  // namespace depth_test
}  // namespace fbvins
