// SPDX-License-Identifier: Apache-2.0
// The orb frontend with landmarks that were out of view.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "fbvins/frontend/orb_frontend.hpp"
#include "tests/support/test_wall.hpp"
#include "tests/support/textured_wall.hpp"

namespace fbvins {
namespace orb_reobservation_test {

using namespace textured_wall;

/// The exact state at frame k.
StatePrior true_state(int k) {
  StatePrior prior;
  prior.t = Time{static_cast<std::int64_t>(k * kFramePeriod_s * 1e9)};
  prior.T_GB = {Quat(Eigen::AngleAxisd(world().angle(k), Vec3::UnitZ())), world().position(k)};
  prior.v_GB = Vec3(kSpeed_mps, 0.02, 0);
  prior.valid = true;
  return prior;
}

/// Ten images, three seconds in the dark, and one image more. `drift_m`: how far the estimate has drifted in the dark.
TrackedFrame after_the_dark(bool enabled, double drift_m, std::vector<TrackedFrame>& before) {
  OrbFrontendOptions options = small_options();
  options.recognition.enabled = enabled;
  OrbFrontend frontend(world().rig, options);
  constexpr int kDark = 60;
  for (int k = 0;; ++k) {
    StatePrior prior = true_state(std::max(0, k - 2));
    if (k == 15) {  // they have left the window by now
      LandmarkUpdate update;
      for (const TrackedFrame& frame : before)
        for (const TrackedFeature& f : frame.features) {
          const Vec2 p = world().wall_point(static_cast<int>(frame.id.value), f.left()->normalised);
          update.landmarks.push_back({f.id, Vec3(p.x(), p.y(), kDepth_m)});
        }
      frontend.locate(update);
    }
    const bool dark = k >= 10 && k < 10 + kDark;
    SensorPacket packet = dark ? world().packet_without_images(k) : world().packet(k);
    if (!dark && k >= 10) prior.T_GB.p.x() += drift_m;
    TrackedFrame tracked = frontend.process(packet, prior);
    if (k == 10 + kDark) return tracked;
    if (!dark) before.push_back(std::move(tracked));
  }
}

TEST(OrbFrontend, LandmarksAreReobservedHoweverLongTheyWereOutOfView) {
  for (const double drift_m : {0.0, 0.08}) {
    std::vector<TrackedFrame> frames;
    frames.push_back(after_the_dark(true, drift_m, frames));
    EXPECT_GT(frames.back().stats.recognised, 15) << drift_m;
    EXPECT_GE(frames.back().stats.expected, frames.back().stats.recognised);
    std::map<std::int64_t, Vec2> first;
    int again = 0, wrong = 0;
    for (const TrackedFrame& frame : frames)
      for (const TrackedFeature& f : frame.features) {
        const Vec2 p = world().wall_point(static_cast<int>(frame.id.value), f.left()->normalised);
        const auto [it, is_new] = first.try_emplace(f.id.value, p);
        if (is_new || frame.id != frames.back().id) continue;
        ++again;
        wrong += (p - it->second).norm() / kDepth_m * 230 > 0.5;
      }
    EXPECT_EQ(again, frames.back().stats.recognised);
    EXPECT_LE(wrong, again / 20) << drift_m;
  }
}

/// A camera that slides along a wall and back, so that half of the wall goes out of view and returns. fly() takes the part of
/// the estimator: exact priors, two frames old, and positions of landmarks some time after they were last observed.
class Sweep {
 public:
  static constexpr int kFrames = 64, kUnseenBeforeTold = 12;
  static constexpr double kPeriod_s = 3.2, kReach_m = 1.6, kOmega_radps = 2 * 3.14159265358979 / kPeriod_s;

  struct Known {
    int frames = 0, last = 0;
    Vec2 px = Vec2::Zero();
    Vec3 p_G = Vec3::Zero();
    bool told = false, again = false;
  };
  std::map<TrackId, Known> known;
  int forgotten = 0;  // landmarks with a position that cannot be re-observed, summed over frames

  int count(bool Known::*what) const {
    return static_cast<int>(std::count_if(known.begin(), known.end(), [&](const auto& k) { return k.second.*what; }));
  }

  /// `prior_every`: 2 withholds every second prior. Every update comes twice.
  void fly(int prior_every) {
    OrbFrontend frontend(wall_.rig(), small_options());
    for (int k = 0; k < kFrames; ++k) {
      const LandmarkUpdate update = left_behind(k);
      for (int i = 0; i < 2; ++i) frontend.locate(update);
      take_in(k, frontend.process(packets()[static_cast<std::size_t>(k)], k % prior_every == 0 ? prior(k - 2) : StatePrior{}));
      for (const auto& [id, landmark] : known) forgotten += landmark.told && !landmark.again && !frontend.can_reobserve(id);
    }
  }

 private:
  static double x_m(double s) { return 0.5 * kReach_m * (1 - std::cos(kOmega_radps * s)); }
  static double a_mps2(double s) { return 0.5 * kReach_m * kOmega_radps * kOmega_radps * std::cos(kOmega_radps * s); }

  const std::vector<SensorPacket>& packets() const {
    static const std::vector<SensorPacket> all = [&] {
      std::vector<SensorPacket> out(kFrames);
      for (int k = 0; k < kFrames; ++k) {
        SensorPacket& p = out[static_cast<std::size_t>(k)];
        const double t_s = k * kFramePeriod_s;
        p.id = FrameId{k};
        p.frame.t = Time{} + Duration::from_seconds(t_s);
        p.frame.set_image(0, wall_.render(x_m(t_s), static_cast<std::uint64_t>(2 * k)));
        p.frame.set_image(1, wall_.render(x_m(t_s) + TestWall::kBaseline_m, static_cast<std::uint64_t>(2 * k + 1)));
        for (int i = 0; k > 0 && i <= 10; ++i) {
          const double s = t_s - kFramePeriod_s + 0.005 * i;
          p.imu.samples.push_back({Time{} + Duration::from_seconds(s), Vec3::Zero(), Vec3(a_mps2(s), 0, 9.81)});
        }
      }
      return out;
    }();
    return all;
  }
  StatePrior prior(int k) const {
    const double s = k * kFramePeriod_s;
    StatePrior prior;
    prior.t = Time{} + Duration::from_seconds(s);
    prior.T_GB.p.x() = x_m(s);
    prior.v_GB.x() = 0.5 * kReach_m * kOmega_radps * std::sin(kOmega_radps * s);
    prior.valid = k >= 0;
    return prior;
  }
  /// Landmarks that left the image over its edge, once each.
  LandmarkUpdate left_behind(int k) {
    LandmarkUpdate update;
    update.sequence = k;
    for (auto& [id, landmark] : known) {
      const double from_edge_px = std::min(landmark.px.x(), TestWall::kWidth - landmark.px.x());
      if (landmark.told || landmark.last != k - kUnseenBeforeTold || landmark.frames < 6 || from_edge_px > 25) continue;
      landmark.told = true;
      update.landmarks.push_back({id, landmark.p_G});
    }
    return update;
  }
  void take_in(int k, const TrackedFrame& frame) {
    for (const TrackedFeature& f : frame.features) {
      Known& landmark = known[f.id];
      if (landmark.told) landmark.again = true;
      else landmark.p_G = Vec3(x_m(k * kFramePeriod_s), 0, 0) + TestWall::kDepth_m * Vec3(f.left()->normalised.homogeneous());
      landmark.px = f.left()->pixel;
      landmark.last = k;
      ++landmark.frames;
    }
  }
  TestWall wall_;
};

TEST(OrbFrontend, NoLandmarkIsLostWithEverySecondPriorWithheld) {
  Sweep all, half;
  all.fly(1);
  half.fly(2);
  EXPECT_GT(all.count(&Sweep::Known::told), 15);
  EXPECT_GT(all.count(&Sweep::Known::again), 10) << "the others left on the way back";
  EXPECT_EQ(all.forgotten, 0);
  EXPECT_EQ(half.forgotten, 0);
  for (const auto& [id, landmark] : all.known) {
    EXPECT_EQ(half.known[id].told, landmark.told) << id.value;
    EXPECT_EQ(half.known[id].again, landmark.again) << id.value;
  }
}

TEST(OrbFrontend, WithoutRecognitionEveryLandmarkIsNew) {
  std::vector<TrackedFrame> before;
  const TrackedFrame after = after_the_dark(false, 0, before);
  EXPECT_EQ(after.stats.recognised, 0);
  EXPECT_EQ(after.stats.detected, static_cast<int>(after.features.size()));
  EXPECT_GT(after.stats.detected, 40);
}

}  // namespace orb_reobservation_test
}  // namespace fbvins
