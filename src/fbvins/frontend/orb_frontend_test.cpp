// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_frontend.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "fbvins/core/options.hpp"
#include "tests/support/textured_wall.hpp"

namespace fbvins {
namespace orb_frontend_test {

using namespace textured_wall;

std::vector<TrackedFrame> run(const std::vector<SensorPacket>& input, const OrbFrontendOptions& options = small_options(),
                              const StereoRig& rig = world().rig,
                              const std::shared_ptr<DescriptorStage>& stage = make_identity_stage()) {
  OrbFrontend frontend(rig, options, stage);
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
      const Vec2 p = world().wall_point(static_cast<int>(k), f.left()->normalised);
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
    rig.cameras[0].camera = Camera(left, kWidth, kHeight), rig.cameras[1].camera = Camera(right, kWidth, kHeight);
    const World wall(rig);
    std::vector<SensorPacket> input;
    for (int k = 0; k < 6; ++k) input.push_back(wall.packet(k));
    const auto frames = run(input, small_options(), rig);
    for (std::size_t k = 1; k < frames.size(); ++k) EXPECT_GT(frames[k].stats.tracked, 40) << rig.left().model_name() << k;
    EXPECT_LT(median_error_px(frames), 0.15) << rig.left().model_name();
    std::vector<double> depths_m;
    for (const TrackedFrame& frame : frames)
      for (const TrackedFeature& f : frame.features)
        if (f.right()) depths_m.push_back(0.11 / (f.left()->normalised - f.right()->normalised).x());
    ASSERT_GT(depths_m.size(), 150u) << rig.left().model_name();
    std::nth_element(depths_m.begin(), depths_m.begin() + std::ssize(depths_m) / 2, depths_m.end());
    EXPECT_NEAR(depths_m[depths_m.size() / 2], kDepth_m, 0.03) << rig.left().model_name();
  }
}

TEST(OrbFrontend, StereoGivesTheWallsDepth) {
  const auto frames = run(packets());
  int stereo = 0, all = 0;
  for (const TrackedFrame& frame : frames)
    for (const TrackedFeature& f : frame.features) {
      ++all;
      if (!f.right()) continue;
      ++stereo;
      const double disparity_px = (f.left()->normalised - f.right()->normalised).x() * 230;
      EXPECT_NEAR(disparity_px, 0.11 / kDepth_m * 230, 0.6);
      EXPECT_NEAR((f.left()->normalised - f.right()->normalised).y() * 230, 0, 0.6);
    }
  EXPECT_GT(stereo, 0.7 * all);
}

TEST(OrbFrontend, ObservationsAreConsistent) {
  const auto frames = run({packets().begin(), packets().begin() + 3});
  for (const TrackedFeature& f : frames.back().features) {
    Mat2 J;
    EXPECT_LT((world().rig.left().distort(f.left()->normalised, &J) - f.left()->pixel).norm(), 1e-6);
    EXPECT_LT((f.left()->sqrt_information - J / small_options().sigma_px).norm(), 1e-9);
  }
}

TEST(OrbFrontend, DetectsInOneImageInFour) {
  const auto frames = run(packets());
  int detected = 0;
  for (std::size_t k = 1; k < frames.size(); ++k) detected += frames[k].stats.detect_ms > 0;
  EXPECT_GT(detected, 0);
  EXPECT_LE(detected, (static_cast<int>(frames.size()) - 1) / 2);
  EXPECT_GT(frames.back().features.size(), 25u);
  EXPECT_LT(median_error_px(frames), 0.12);
}

TEST(OrbFrontend, WithImprovedDescriptorsTracksAreStartedInTheImageAfterTheirKeypoints) {
  struct Improver final : DescriptorStage {
    void improve(int, int, OrbFeatures&) override {}
    bool changes_descriptors() const override { return true; }
  };
  const auto frames = run(packets(), small_options(), world().rig, std::make_shared<Improver>());
  EXPECT_LT(median_error_px(frames), 0.12);
  int started = 0;
  for (std::size_t k = 1; k < frames.size(); ++k) {
    if (frames[k].stats.detected == 0) continue;
    EXPECT_GT(frames[k - 1].stats.detect_ms, 0) << k;
    started += frames[k].stats.detected;
  }
  EXPECT_GT(started, 0);
}

TEST(OrbFrontend, TracksSurviveBlackAndMissingImagesUnderTheirOldId) {
  for (const bool missing : {true, false}) {
    std::vector<SensorPacket> input = packets();
    for (std::size_t k = 5; k < 8; ++k) {
      input[k].frame.set_image(0, missing ? nullptr : std::make_shared<const Image>(kWidth, kHeight));
      input[k].frame.set_image(1, nullptr);
    }
    const auto frames = run(input);
    for (std::size_t k = 5; k < 8; ++k) EXPECT_TRUE(frames[k].features.empty()) << k;
    int old = 0;
    for (const TrackedFeature& f : frames[8].features) old += f.age_frames > 0;
    EXPECT_GT(old, 25) << (missing ? "missing" : "black");
    EXPECT_LT(median_error_px(frames), 0.12);
  }
}

TEST(OrbFrontend, WithoutRightImageThereIsNoStereo) {
  std::vector<SensorPacket> input(packets().begin(), packets().begin() + 4);
  for (SensorPacket& p : input) p.frame.set_image(1, nullptr);
  const auto frames = run(input);
  EXPECT_EQ(frames.back().stats.stereo, 0);
  EXPECT_GT(frames.back().stats.tracked, 40);
}

TEST(OrbFrontend, WrongSizeTimeJumpsAndNoImuAreHarmless) {
  std::vector<SensorPacket> input(packets().begin(), packets().begin() + 6);
  input[2].frame.set_image(0, std::make_shared<const Image>(100, 80, std::uint8_t{90}));
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
      EXPECT_TRUE(a[k].features[i].left()->pixel == b[k].features[i].left()->pixel);
      EXPECT_EQ(a[k].features[i].by_several(), b[k].features[i].by_several());
    }
  }
}

TEST(OrbFrontendOptions, DefaultsAreValid) { EXPECT_TRUE(validate(OrbFrontendOptions{}).ok()); }

TEST(OrbFrontend, HasNoFeatureInTheMask) {
  StereoRig rig = make_rig();
  Image left(kWidth, kHeight, 255), right(kWidth, kHeight, 255);
  hide(left, MaskRectangle{150, 0, 60, kHeight});
  hide(right, MaskCircle{250, 120, 40});
  rig.cameras[0].camera.set_mask(std::make_shared<const Mask>(left));
  rig.cameras[1].camera.set_mask(std::make_shared<const Mask>(right));
  int in_right = 0;
  for (const TrackedFrame& frame : run(packets(), small_options(), rig)) {
    EXPECT_GT(frame.features.size(), 40u);
    for (const TrackedFeature& feature : frame.features) {
      EXPECT_FALSE(rig.left().hidden(feature.left()->pixel, kPatchBorder_px));
      if (!feature.right()) continue;
      EXPECT_FALSE(rig.right().hidden(feature.right()->pixel, kPatchBorder_px));
      ++in_right;
    }
  }
  EXPECT_GT(in_right, 150);
}

}  // namespace orb_frontend_test
}  // namespace fbvins
