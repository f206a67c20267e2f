// SPDX-License-Identifier: Apache-2.0
// Rendered flights with two lenses of 200 degrees. Side by side: what is beside and behind the lenses' planes is used, and a lens
// without images is named as the camera that it is. Back to back: what both see, at their edges, has a depth from the first image
// on.
#include <gtest/gtest.h>

#include "fbvins/camera/virtual_pinholes.hpp"
#include "fbvins/config/config.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/pipeline/system.hpp"
#include "fbvins/sim/simulation.hpp"
#include "tests/support/rendered_recording.hpp"

namespace fbvins {
namespace wide_lenses_test {

constexpr double kBlindFrom_s = 2.5;

SimulationOptions options(const std::string& preset = "fisheye") {
  SimulationOptions options = *simulation_preset(preset);
  options.seed = 31;
  options.flight.duration_s = 4;
  options.camera.time_samples = 1;
  return options;
}

/// Rendered once.
const test::RenderedRecording& recorded() {
  static const test::RenderedRecording recorded = test::rendered(options());
  return recorded;
}

const test::RenderedRecording& back_to_back() {
  static const test::RenderedRecording recorded = test::rendered(options("back-to-back"));
  return recorded;
}

struct Flown {
  std::vector<Odometry> poses;
  std::size_t seen_by_both = 0;         ///< features
  std::size_t features_of[2] = {0, 0};  ///< by camera
  std::size_t behind = 0;               ///< whose ray looks backwards
};

/// `blind`: the right lens delivers nothing from kBlindFrom_s on.
Flown fly(const std::string& frontend, bool blind, const test::RenderedRecording& recording = recorded()) {
  Config config;
  config.frontend.kind = frontend;
  Result<System> system = System::create(config, recording.rig);
  EXPECT_TRUE(system.ok());
  Flown out;
  system->on_odometry([&](const Odometry& o) { out.poses.push_back(o); });
  system->on_tracked_frame([&](const TrackedFrame& frame) {
    EXPECT_LE(frame.cameras.size(), 2u);
    for (const TrackedFeature& f : frame.features) {
      const Observation& first = f.seen.front();
      const int camera = first.camera;
      ASSERT_TRUE(camera == 0 || camera == 1);
      ++out.features_of[camera];
      out.seen_by_both += f.by_several();
      const auto ray = recording.rig.camera(camera).ray(first.pixel);
      ASSERT_TRUE(ray);
      out.behind += ray->z() < 0;
    }
  });
  std::optional<Time> first;
  for (SensorEvent event : recording.events) {
    if (auto* frame = std::get_if<StereoFrame>(&event)) {
      if (!first) first = frame->t;
      if (blind && (frame->t - *first).seconds() >= kBlindFrom_s) frame->set_image(1, nullptr);
    }
    EXPECT_TRUE(system->push(std::move(event)).ok());
  }
  EXPECT_TRUE(system->finish().ok());
  EXPECT_EQ(system->calibration().camera_count(), 2);
  return out;
}

class EachFrontend : public testing::TestWithParam<const char*> {};

/// More than 60 of the flight's 80 poses: it starts within the first second.
double error_m(const Flown& flown, const test::RenderedRecording& recording) {
  Trajectory<W> estimate;
  for (const Odometry& o : flown.poses)
    if (o.health.has_pose()) estimate.push_back({o.t, o.T_WB});
  EXPECT_GT(estimate.size(), 60U);
  EXPECT_EQ(flown.poses.back().health.state, HealthState::good);
  return evaluate(recording.truth, estimate, {})->absolute_m.rmse;
}

TEST_P(EachFrontend, UsesWhatIsBehindTheLens) {
  const Flown flown = fly(GetParam(), false);
  EXPECT_GT(flown.behind, flown.poses.size());
  EXPECT_LT(error_m(flown, recorded()), 0.015);
}

TEST_P(EachFrontend, MeasuresDepthWhereLensesBackToBackOverlap) {
  const Flown flown = fly(GetParam(), false, back_to_back());
  for (const std::size_t features : flown.features_of) EXPECT_GT(features, 60 * flown.poses.size());
  EXPECT_GT(flown.seen_by_both, 40 * flown.poses.size());
  EXPECT_LT(error_m(flown, back_to_back()), 0.015);
}

TEST(WideLensFlight, NamesTheLensThatDeliversNothing) {
  const Flown flown = fly("klt", true);
  const Health& health = flown.poses.back().health;
  EXPECT_EQ(health.state, HealthState::degraded);
  EXPECT_EQ(health.reason, HealthReason::one_camera);
  EXPECT_EQ(cameras_in(health.without_cameras), std::vector<int>{1});
}

INSTANTIATE_TEST_SUITE_P(WideLensFlight, EachFrontend, testing::Values("klt", "boost"));

TEST(WideLensFlight, OnlineExtrinsicsAreRefused) {
  Config config;
  config.estimator.estimate_extrinsics = true;
  const Result<System> system = System::create(config, *simulated_rig(options()));
  ASSERT_FALSE(system);
  EXPECT_NE(system.error().message.find("more than 180 degrees"), std::string::npos);
}

}  // namespace wide_lenses_test
}  // namespace fbvins
