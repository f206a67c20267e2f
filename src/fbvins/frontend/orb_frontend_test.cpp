// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_frontend.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "fbvins/core/options.hpp"
#include "fbvins/features/noise_texture.hpp"
#include "fbvins/frontend/test_wall.hpp"

namespace fbvins {
namespace orb_frontend_test {

constexpr int kWidth = 376, kHeight = 240;
constexpr double kDepth_m = 3.0, kSpeed_mps = 0.4, kFramePeriod_s = 0.05;

StereoRig make_rig() {
  StereoRig rig;
  PinholeRadtan model;
  model.fx = model.fy = 230;
  model.cx = 187.5, model.cy = 119.5;
  model.k1 = -0.05;
  rig.left = rig.right = Camera(model, kWidth, kHeight);
  rig.T_BC1 = Pose<B, C1>(Quat::Identity(), Vec3(0.11, 0, 0));
  return rig;
}

/// A textured wall 3 m ahead; the body moves along x and turns about z, with exact readings.
class World {
 public:
  Vec3 position(int k) const { return {kSpeed_mps * kFramePeriod_s * k, 0.02 * k * kFramePeriod_s, 0}; }
  double angle(int k) const { return 0.2 * kFramePeriod_s * k; }

  std::shared_ptr<const Image> render(int k, double offset_x, std::uint64_t noise_seed) const {
    const Camera& camera = offset_x > 0 ? rig.right : rig.left;
    const Eigen::Rotation2Dd R(angle(k));
    const Vec2 centre = position(k).head<2>() + R * Vec2(offset_x, 0);
    const auto warp = [&](const Vec2& px) { return Vec2((centre + R * (*camera.undistort(px) * kDepth_m)) * 230 / kDepth_m); };
    return std::make_shared<const Image>(render_texture(kWidth, kHeight, texture, warp, 120, 35, 1.0, noise_seed));
  }

  SensorPacket packet(int k) const {
    SensorPacket p = packet_without_images(k);
    p.frame.left = render(k, 0, static_cast<std::uint64_t>(2 * k));
    p.frame.right = render(k, 0.11, static_cast<std::uint64_t>(2 * k + 1));
    return p;
  }

  SensorPacket packet_without_images(int k) const {
    SensorPacket p;
    p.id = FrameId{k};
    p.frame.t = Time{static_cast<std::int64_t>(k * kFramePeriod_s * 1e9)};
    for (int i = 0; k > 0 && i <= 10; ++i)
      p.imu.samples.push_back({Time{p.frame.t.ns - 50'000'000 + 5'000'000 * i}, Vec3(0, 0, 0.2), Vec3(0, 0, 9.81)});
    return p;
  }

  /// Where a point of the wall is seen in the left image of frame k, from normalised coordinates there.
  Vec2 wall_point(int k, const Vec2& normalised) const {
    return position(k).head<2>() + Eigen::Rotation2Dd(angle(k)) * Vec2(normalised * kDepth_m);
  }

  explicit World(const StereoRig& seen_by = make_rig()) : rig(seen_by) {}
  StereoRig rig;

 private:
  NoiseTexture texture{11, 30};
};

const World& world() {
  static const World w;
  return w;
}

const std::vector<SensorPacket>& packets() {
  static const std::vector<SensorPacket> all = [] {
    std::vector<SensorPacket> p;
    for (int k = 0; k < 10; ++k) p.push_back(world().packet(k));
    return p;
  }();
  return all;
}

OrbFrontendOptions small_options() {
  OrbFrontendOptions options;
  options.max_features = 80;
  options.max_keypoints = 250;
  return options;
}

std::vector<TrackedFrame> run(const std::vector<SensorPacket>& input, const OrbFrontendOptions& options = small_options(),
                              const StereoRig& rig = world().rig) {
  OrbFrontend frontend(rig, options);
  std::vector<TrackedFrame> out;
  for (const SensorPacket& p : input) out.push_back(frontend.process(p, StatePrior{}));
  return out;
}

/// Median distance, in px, between a track's points on the wall in later images and in its first one.
double median_error_px(const std::vector<TrackedFrame>& frames) {
  std::map<std::int64_t, Vec2> first;
  std::vector<double> errors;
  for (std::size_t k = 0; k < frames.size(); ++k)
    for (const TrackedFeature& f : frames[k].features) {
      const Vec2 p = world().wall_point(static_cast<int>(k), f.left->normalised);
      const auto [it, is_new] = first.try_emplace(f.id.value, p);
      if (!is_new) errors.push_back((p - it->second).norm() / kDepth_m * 230);
    }
  if (errors.size() < 50) return 1e9;
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  return errors[errors.size() / 2];
}

TEST(OrbFrontend, FollowsAWallBelowATenthOfAPixel) {
  const auto frames = run(packets());
  EXPECT_GT(frames[0].stats.detected, 50);
  EXPECT_EQ(frames[0].stats.tracked, 0);
  for (std::size_t k = 1; k < frames.size(); ++k) EXPECT_GT(frames[k].stats.tracked, 40) << k;
  EXPECT_LT(median_error_px(frames), 0.1);
}

/// Lenses of some 110 degrees across, the left one unlike the right one.
TEST(OrbFrontend, FollowsAWallThroughWideLensesAndSeesItsDepth) {
  const LensModel double_sphere = DoubleSphere{150, 150, 187.5, 119.5, -0.17, 0.59},
                  extended = ExtendedUnified{160, 160, 187.5, 119.5, 0.63, 1.04},
                  unified = UnifiedRadtan{270, 270, 187.5, 119.5, 0.8, -0.05, 0.01, 0.0005, 0.0005};
  for (const auto& [left, right] : {std::pair(double_sphere, extended), {extended, unified}, {unified, double_sphere}}) {
    StereoRig rig = make_rig();
    rig.left = Camera(left, kWidth, kHeight), rig.right = Camera(right, kWidth, kHeight);
    const World wall(rig);
    std::vector<SensorPacket> input;
    for (int k = 0; k < 6; ++k) input.push_back(wall.packet(k));
    const auto frames = run(input, small_options(), rig);
    for (std::size_t k = 1; k < frames.size(); ++k) EXPECT_GT(frames[k].stats.tracked, 40) << rig.left.model_name() << k;
    EXPECT_LT(median_error_px(frames), 0.15) << rig.left.model_name();
    std::vector<double> depths_m;
    for (const TrackedFrame& frame : frames)
      for (const TrackedFeature& f : frame.features)
        if (f.right) depths_m.push_back(0.11 / (f.left->normalised - f.right->normalised).x());
    ASSERT_GT(depths_m.size(), 150u) << rig.left.model_name();
    std::nth_element(depths_m.begin(), depths_m.begin() + std::ssize(depths_m) / 2, depths_m.end());
    EXPECT_NEAR(depths_m[depths_m.size() / 2], kDepth_m, 0.03) << rig.left.model_name();
  }
}

TEST(OrbFrontend, WithoutSubpixelRefinementErrorsAreLarger) {
  OrbFrontendOptions options = small_options();
  options.subpixel = false;
  options.fill_in = false;
  const double without = median_error_px(run(packets(), options));
  EXPECT_GT(without, 0.2);
  EXPECT_LT(without, 1.5);
}

TEST(OrbFrontend, StereoGivesTheWallsDepth) {
  const auto frames = run(packets());
  int stereo = 0, all = 0;
  for (const TrackedFrame& frame : frames)
    for (const TrackedFeature& f : frame.features) {
      ++all;
      if (!f.right) continue;
      ++stereo;
      const double disparity_px = (f.left->normalised - f.right->normalised).x() * 230;
      EXPECT_NEAR(disparity_px, 0.11 / kDepth_m * 230, 0.6);
      EXPECT_NEAR((f.left->normalised - f.right->normalised).y() * 230, 0, 0.6);
    }
  EXPECT_GT(stereo, 0.7 * all);
}

TEST(OrbFrontend, ObservationsAreConsistent) {
  const auto frames = run({packets().begin(), packets().begin() + 3});
  for (const TrackedFeature& f : frames.back().features) {
    Mat2 J;
    EXPECT_LT((world().rig.left.distort(f.left->normalised, &J) - f.left->pixel).norm(), 1e-6);
    EXPECT_LT((f.left->sqrt_information - J / small_options().sigma_px).norm(), 1e-9);
  }
}

TEST(OrbFrontend, ExaminesOneImageInFourOrAllOfThem) {
  for (const bool all : {false, true}) {
    OrbFrontendOptions options = small_options();
    options.examine_all = all;
    const auto frames = run(packets(), options);
    int matched = 0;
    for (std::size_t k = 1; k < frames.size(); ++k) matched += frames[k].stats.matches.found > 0;
    const int after_first = static_cast<int>(frames.size()) - 1;
    if (all) EXPECT_EQ(matched, after_first);
    else EXPECT_LE(matched, after_first / 2);
    EXPECT_GT(frames.back().features.size(), 25u);
    EXPECT_LT(median_error_px(frames), 0.12);
  }
}

TEST(OrbFrontend, TracksSurviveBlackAndMissingImagesUnderTheirOldId) {
  for (const bool missing : {true, false}) {
    std::vector<SensorPacket> input = packets();
    for (std::size_t k = 5; k < 8; ++k) {
      input[k].frame.left = missing ? nullptr : std::make_shared<const Image>(kWidth, kHeight);
      input[k].frame.right = nullptr;
    }
    const auto frames = run(input);
    for (std::size_t k = 5; k < 8; ++k) EXPECT_TRUE(frames[k].features.empty()) << k;
    int old = 0;
    for (const TrackedFeature& f : frames[8].features) old += f.age_frames > 0;
    EXPECT_GT(old, 25) << (missing ? "missing" : "black");
    EXPECT_LT(median_error_px(frames), 0.12);
  }
}

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
          const Vec2 p = world().wall_point(static_cast<int>(frame.id.value), f.left->normalised);
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
        const Vec2 p = world().wall_point(static_cast<int>(frame.id.value), f.left->normalised);
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
        p.frame.left = wall_.render(x_m(t_s), static_cast<std::uint64_t>(2 * k));
        p.frame.right = wall_.render(x_m(t_s) + TestWall::kBaseline_m, static_cast<std::uint64_t>(2 * k + 1));
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
      else landmark.p_G = Vec3(x_m(k * kFramePeriod_s), 0, 0) + TestWall::kDepth_m * Vec3(f.left->normalised.homogeneous());
      landmark.px = f.left->pixel;
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

TEST(OrbFrontend, WithoutRightImageThereIsNoStereo) {
  std::vector<SensorPacket> input(packets().begin(), packets().begin() + 4);
  for (SensorPacket& p : input) p.frame.right = nullptr;
  const auto frames = run(input);
  EXPECT_EQ(frames.back().stats.stereo, 0);
  EXPECT_GT(frames.back().stats.tracked, 40);
}

TEST(OrbFrontend, WrongSizeTimeJumpsAndNoImuAreHarmless) {
  std::vector<SensorPacket> input(packets().begin(), packets().begin() + 6);
  input[2].frame.left = std::make_shared<const Image>(100, 80, std::uint8_t{90});
  input[3].imu.samples.clear();
  input[4].frame.t = input[4].frame.t + Duration::from_seconds(5);  // a gap
  input[5].frame.t = input[0].frame.t;                              // backwards
  const auto frames = run(input);
  EXPECT_TRUE(frames[2].features.empty());
  EXPECT_GT(frames[3].stats.tracked, 30);
  for (const std::size_t k : {4u, 5u}) {
    EXPECT_EQ(frames[k].stats.tracked, 0);
    EXPECT_GT(frames[k].stats.detected, 40);
  }
}

TEST(OrbFrontend, SameInputSameBits) {
  const auto a = run(packets()), b = run(packets());
  for (std::size_t k = 0; k < a.size(); ++k) {
    ASSERT_EQ(a[k].features.size(), b[k].features.size());
    for (std::size_t i = 0; i < a[k].features.size(); ++i) {
      EXPECT_EQ(a[k].features[i].id, b[k].features[i].id);
      EXPECT_TRUE(a[k].features[i].left->pixel == b[k].features[i].left->pixel);
      EXPECT_EQ(a[k].features[i].right.has_value(), b[k].features[i].right.has_value());
    }
  }
}

TEST(OrbFrontendOptions, DefaultsAreValid) { EXPECT_TRUE(validate(OrbFrontendOptions{}).ok()); }

TEST(OrbFrontend, HasNoFeatureInTheMask) {
  StereoRig rig = make_rig();
  Image left(kWidth, kHeight, 255), right(kWidth, kHeight, 255);
  hide(left, MaskRectangle{150, 0, 60, kHeight});
  hide(right, MaskCircle{250, 120, 40});
  rig.left.set_mask(std::make_shared<const Mask>(left));
  rig.right.set_mask(std::make_shared<const Mask>(right));
  for (const bool examine_all : {false, true}) {
    OrbFrontendOptions options = small_options();
    options.examine_all = examine_all;
    int in_right = 0;
    for (const TrackedFrame& frame : run(packets(), options, rig)) {
      EXPECT_GT(frame.features.size(), 40u);
      for (const TrackedFeature& feature : frame.features) {
        EXPECT_FALSE(rig.left.hidden(feature.left->pixel, kPatchBorder_px));
        if (!feature.right) continue;
        EXPECT_FALSE(rig.right.hidden(feature.right->pixel, kPatchBorder_px));
        ++in_right;
      }
    }
    EXPECT_GT(in_right, 150);
  }
}

}  // namespace orb_frontend_test
}  // namespace fbvins
