// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/rig_diagnosis.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace rig_diagnosis_test {

/// Cameras 0 and 2 look ahead, 1 and 3 backwards.
StereoRig quad() {
  const Camera camera(PinholeRadtan{300, 300, 160, 120}, 320, 240);
  const Quat backwards(Eigen::AngleAxisd(M_PI, Vec3::UnitY()));
  return with_cameras({}, {{camera, {}},
                           {camera, {backwards, Vec3(0, 0, -0.1)}},
                           {camera, {Quat::Identity(), Vec3(0.1, 0, 0)}},
                           {camera, {backwards, Vec3(0.1, 0, -0.1)}}});
}

Diagnosis with(const StereoRig& rig, std::initializer_list<FindingKind> kinds) {
  Diagnosis out;
  out.rig = rig;
  for (const FindingKind kind : kinds) {
    Finding finding;
    finding.kind = kind;
    finding.measured = "it is so";
    finding.corrected = "cam0/sensor.yaml: intrinsics: [1, 0.5]\ncam1: mask: mask1.png";
    out.findings.push_back(finding);
  }
  out.masks = {nullptr, std::make_shared<const Mask>(Image(320, 240))};
  return out;
}

TEST(RigDiagnosis, FramesOfAPairHaveItsImagesAsLeftAndRight) {
  StereoFrame frame{Time{1000}, {std::make_shared<const Image>(1, 1), nullptr, nullptr, std::make_shared<const Image>(2, 1)}};
  frame.offsets = ExposureOffsets({Duration{0}, Duration{5}, Duration{0}, Duration{7}});
  const auto back = frame_of_group(frame, {1, 3});
  ASSERT_TRUE(back);
  EXPECT_EQ(back->t, Time{1005});
  EXPECT_EQ(back->left(), nullptr);
  EXPECT_EQ(back->right()->width(), 2);
  EXPECT_EQ(back->offsets.of(1), Duration{2});
  frame.images.resize(2);
  EXPECT_FALSE(frame_of_group(frame, {1, 3}));
}

TEST(RigDiagnosis, FindingsHaveTheNumbersOfTheirCamerasAndTheImuIsJudgedOnce) {
  using enum FindingKind;
  const StereoRig rig = quad();
  const CameraGroup ahead{0, 2}, back{1, 3};
  Diagnosis all;
  all.rig = rig;
  add_group(with(rig_of(rig, ahead), {gyro_units, baseline_length}), ahead, true, all);
  Diagnosis second = with(rig_of(rig, back), {gyro_units, time_offset, focal_length});
  second.rig.cameras[1].camera = Camera(PinholeRadtan{333, 333, 160, 120}, 320, 240);
  add_group(second, back, false, all);
  ASSERT_EQ(all.findings.size(), 3u);
  EXPECT_EQ(all.findings[0].measured, "it is so");
  EXPECT_EQ(all.findings[1].measured, "cameras 0 and 2 as left and right: it is so");
  EXPECT_EQ(all.findings[1].corrected, "cam0/sensor.yaml: intrinsics: [1, 0.5]\ncam2: mask: mask2.png");
  EXPECT_EQ(all.findings[2].corrected, "cam1/sensor.yaml: intrinsics: [1, 0.5]\ncam3: mask: mask3.png");
  EXPECT_EQ(all.rig.camera(3).focal_px(), 333);
  EXPECT_EQ(all.rig.camera(2).focal_px(), 300);
  ASSERT_EQ(all.masks.size(), 4u);
  EXPECT_TRUE(!all.masks[0] && !all.masks[1] && all.masks[2] && all.masks[3]);
}

TEST(RigDiagnosis, CamerasOfDifferentGroupsThatOverlapAreComparedByTheirEpipolarLines) {
  const StereoRig apart = quad();
  EXPECT_TRUE(pairs_across(apart).empty());
  StereoRig rig = apart;  // and one beside the pair ahead
  rig.cameras.push_back({rig.left(), {Quat::Identity(), Vec3(0.3, 0, 0)}});
  const std::vector<CameraGroup> pairs = pairs_across(rig);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].first, 2);
  EXPECT_EQ(pairs[0].second, 4);

  using enum FindingKind;
  Diagnosis all;
  all.rig = rig;
  Diagnosis across = with(rig_of(rig, pairs[0]), {gyro_units, right_camera_turned, focal_length});
  across.epipolar_px = 2.5;
  across.rig.cameras[1].camera = Camera(PinholeRadtan{333, 333, 160, 120}, 320, 240);
  add_across(across, pairs[0], all);
  ASSERT_EQ(all.findings.size(), 1u);
  EXPECT_EQ(all.findings[0].measured, "cameras 2 and 4 as left and right: it is so");
  EXPECT_EQ(all.findings[0].corrected, "");
  EXPECT_EQ(all.rig.camera(4).focal_px(), 300);
  EXPECT_EQ(all.measured,
            std::vector<std::string>{"cameras 2 and 4 as left and right: matches lie 2.50 px from their epipolar lines"});
  across.epipolar_px.reset();
  add_across(across, pairs[0], all);
  EXPECT_EQ(all.not_judged.size(), 1u);
}

/// A recording without any event: only which cameras are examined shows.
TEST(RigDiagnosis, EachPairIsExaminedAndEachCameraWithoutAPartner) {
  StereoRig rig = quad();
  rig.cameras.push_back({rig.left(), {Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitY())), Vec3(0.3, 0, 0)}});
  int played = 0;
  const Replay replay = [&](const TakeEvent&) { return ++played, Result<void>{}; };
  const auto found = diagnose(rig, replay, CalibrationStyle::kalibr);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_GE(played, 2);
  const auto told = [&](const std::string& what) {
    return std::ranges::any_of(found->not_judged, [&](const std::string& s) { return s.find(what) != std::string::npos; });
  };
  EXPECT_TRUE(told("cameras 0 and 2 as left and right: "));
  EXPECT_TRUE(told("cameras 1 and 3 as left and right: "));
  EXPECT_TRUE(told("camera 4: gyroscope, axes, rotation and time")) << testing::PrintToString(found->not_judged);
}

}  // namespace rig_diagnosis_test
}  // namespace fbvins
