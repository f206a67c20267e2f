// SPDX-License-Identifier: Apache-2.0
// Common mistakes as calibrations, and the judgement of a corrected one; rendered flights: tests/doctor.
#include "fbvins/doctor/corrected_rig.hpp"

#include <gtest/gtest.h>

#include "fbvins/doctor/common_mistakes.hpp"
#include "tests/support/setup_faults.hpp"
#include "tests/support/synthetic_evidence.hpp"

namespace fbvins {
namespace common_mistakes_test {

Finding of(FindingKind kind, double size = 1) {
  Finding finding;
  finding.kind = kind, finding.size = size;
  return finding;
}

const CommonMistake& mistake_with(const std::vector<CommonMistake>& all, const std::string& what) {
  for (const CommonMistake& mistake : all)
    if (mistake.what.find(what) != std::string::npos) return mistake;
  ADD_FAILURE() << what;
  return all.front();
}

TEST(CommonMistakes, AreUndoneByTheirCalibration) {
  const StereoRig right = test::synthetic_rig();
  for (const auto& [fault, what] : {std::pair{"both transforms to the IMU inverted", "both cameras' transforms"},
                                    {"right transform to the IMU inverted", "the right camera's transform"},
                                    {"transform from camera to camera inverted", "from camera to camera"},
                                    {"lenses of a calibration at half the size", "twice the calibration's size"},
                                    {"lenses exchanged", "lenses exchanged"}}) {
    StereoRig wrong = right;
    for (const SetupFault& injected : setup_faults(right))
      if (injected.name == fault) injected.rig(wrong);
    const StereoRig undone = mistake_with(common_mistakes(wrong), what).rig;
    EXPECT_LT((undone.T_BC0().p - right.T_BC0().p).norm() + (undone.T_BC1().p - right.T_BC1().p).norm(), 1e-12) << fault;
    EXPECT_LT((undone.T_BC0().R() - right.T_BC0().R()).norm() + (undone.T_BC1().R() - right.T_BC1().R()).norm(), 1e-12) << fault;
    EXPECT_NEAR(undone.left().focal_px(), right.left().focal_px(), 1e-9) << fault;
    EXPECT_NEAR(undone.right().intrinsics()[2], right.right().intrinsics()[2], 1e-9) << fault;
  }
}

TEST(CommonMistakes, ACameraUpsideDownSeesTheSame) {
  const StereoRig rig = test::synthetic_rig();
  const StereoRig turned = mistake_with(common_mistakes(rig), "upside down").rig;
  const Vec3 p_B(4, 0.3, -0.5);
  const Vec2 px = *rig.left().project(rig.T_BC0().inverse() * p_B),
             there = *turned.left().project(turned.T_BC0().inverse() * p_B);
  EXPECT_LT((px + there - Vec2(rig.left().width() - 1, rig.left().height() - 1)).norm(), 1e-9);
}

TEST(CommonMistakes, OneMirroredCameraIsThoughtOfWhereThePairHasNoMatches) {
  const StereoRig rig = test::synthetic_rig();
  const CommonMistake mirrored = mistake_with(common_mistakes(rig), "right camera's images mirrored");
  EXPECT_EQ(mirrored.flipped, FlippedCameras::right);
  Diagnosis diagnosis;
  EXPECT_FALSE(may_be(mirrored, {}, diagnosis));
  diagnosis.not_judged = {"the pair of cameras: too few points are seen in both images"};
  EXPECT_TRUE(is_strange(diagnosis));
  EXPECT_TRUE(may_be(mirrored, {}, diagnosis));
}

TEST(CommonMistakes, AreThoughtOfWhereSomethingIsVeryWrong) {
  Diagnosis diagnosis;
  EXPECT_FALSE(is_strange(diagnosis));
  diagnosis.findings = {of(FindingKind::imu_camera_rotation, 5), of(FindingKind::baseline_length, 12)};
  EXPECT_FALSE(is_strange(diagnosis));
  diagnosis.findings[0].size = 170;
  EXPECT_TRUE(is_strange(diagnosis));
}

TEST(CorrectedRig, IsBetterWithFewerUnknownFigures) {
  Diagnosis before, after;
  before.epipolar_px = 4, after.epipolar_px = 0.4;
  before.findings = {of(FindingKind::right_camera_turned), of(FindingKind::imu_stamps)};
  after.findings = {of(FindingKind::imu_stamps)};
  EXPECT_TRUE(is_better(before, after));
  after.findings.push_back(of(FindingKind::imu_camera_rotation));
  const Result<void> as_bad = is_better(before, after);
  ASSERT_FALSE(as_bad);
  EXPECT_EQ(as_bad.error().message,
            "as much is wrong with the corrected calibration as before (before: right_camera_turned, imu_stamps; with it: "
            "imu_stamps, imu_camera_rotation)");
}

TEST(CorrectedRig, IsNotBetterWhereTheImagesFitWorse) {
  Diagnosis before, after;
  before.findings = {of(FindingKind::baseline_length)};
  before.epipolar_px = 0.4, after.epipolar_px = 0.7;
  const Result<void> worse = is_better(before, after);
  ASSERT_FALSE(worse);
  EXPECT_EQ(worse.error().message, "the epipolar error grows from 0.40 to 0.70 px");
  after.epipolar_px.reset();
  EXPECT_EQ(is_better(before, after).error().message, "the epipolar error can no longer be judged");
  after.epipolar_px = 0.45;
  EXPECT_TRUE(is_better(before, after));
}

TEST(CalibrationLines, EachFieldHasOneLineAtItsFirstFinding) {
  const StereoRig rig = test::synthetic_rig();
  std::vector<Finding> findings{of(FindingKind::right_camera_turned), of(FindingKind::imu_camera_rotation),
                                of(FindingKind::baseline_length)};
  findings[0].fields = findings[2].fields = {CalibrationField::mounting_of_right};
  findings[1].fields = {CalibrationField::mounting_of_left, CalibrationField::mounting_of_right};
  write_lines(findings, rig, CalibrationStyle::kalibr);
  EXPECT_EQ(findings[0].corrected, line_of(CalibrationField::mounting_of_right, rig, CalibrationStyle::kalibr));
  EXPECT_EQ(findings[1].corrected, line_of(CalibrationField::mounting_of_left, rig, CalibrationStyle::kalibr));
  EXPECT_EQ(findings[2].corrected, "");
}

}  // namespace common_mistakes_test
}  // namespace fbvins
