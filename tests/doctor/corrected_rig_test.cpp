// SPDX-License-Identifier: Apache-2.0
// A rendered flight with wrong calibrations: common mistakes are told as one cause, and what is offered has been judged.
#include <gtest/gtest.h>

#include "fbvins/doctor/corrected_rig.hpp"
#include "fbvins/sim/simulation.hpp"
#include "tests/support/rendered_recording.hpp"
#include "tests/support/setup_faults.hpp"

namespace fbvins {
namespace corrected_rig_test {

struct Flight : test::RenderedRecording {
  Replay replay(const SetupFault& fault = {}) const {
    return [this, fault](const TakeEvent& take) -> Result<void> {
      for (SensorEvent event : events) {
        if (auto* frame = std::get_if<StereoFrame>(&event); frame != nullptr && fault.frame) fault.frame(*frame);
        if (auto* sample = std::get_if<ImuSample>(&event); sample != nullptr) {
          if (fault.lost && fault.lost(*sample)) continue;
          if (fault.reading) fault.reading(*sample);
        }
        if (!take(std::move(event))) break;
      }
      return {};
    };
  }
};

const Flight& handheld() {
  static const Flight flight = [] {
    SimulationOptions options = *simulation_preset("handheld");
    options.seed = 2;
    options.flight.duration_s = 8;
    options.image_rate_hz = 10;
    return Flight{test::rendered(options)};
  }();
  return flight;
}

SetupFault fault_named(const std::string& name) {
  for (SetupFault& fault : setup_faults(handheld().rig))
    if (fault.name == name) return std::move(fault);
  ADD_FAILURE() << "there is no fault '" << name << "'";
  return {};
}

StereoRig spoilt_rig(const SetupFault& fault) {
  StereoRig rig = handheld().rig;
  if (fault.rig) fault.rig(rig);
  return rig;
}

double degrees_between(const Mat3& a, const Mat3& b) { return 57.3 * so3_log(Quat(Mat3(a.transpose() * b))).norm(); }

void expect_right(const StereoRig& rig) {
  const StereoRig& right = handheld().rig;
  EXPECT_LT(degrees_between(rig.T_BC0().R(), right.T_BC0().R()), 0.5);
  EXPECT_LT(degrees_between(rig.T_C1C0().R(), right.T_C1C0().R()), 0.1);
  EXPECT_LT((rig.T_C1C0().p - right.T_C1C0().p).norm(), 0.04 * right.T_C1C0().p.norm());
  EXPECT_NEAR(rig.left().focal_px(), right.left().focal_px(), 0.01 * right.left().focal_px());
  EXPECT_NEAR(rig.time_offset_s, right.time_offset_s, 1e-3);
}

/// The first finding, whose kind is the fault's, and the corrected rig.
CorrectedRig corrected(const std::string& name) {
  const SetupFault fault = fault_named(name);
  const StereoRig rig = spoilt_rig(fault);
  const Result<Diagnosis> diagnosis = diagnose(rig, handheld().replay(fault), CalibrationStyle::kalibr);
  EXPECT_TRUE(diagnosis.ok());
  EXPECT_FALSE(diagnosis->findings.empty()) << name;
  if (!diagnosis->findings.empty()) {
    EXPECT_EQ(diagnosis->findings.front().kind, fault.kind) << to_text(*diagnosis, true);
  }
  Result<CorrectedRig> out = correct_rig(rig, *diagnosis, handheld().replay(fault), CalibrationStyle::kalibr);
  EXPECT_TRUE(out.ok());
  return *std::move(out);
}

TEST(DoctorCorrects, TransformsInTheOtherDirection) {
  for (const char* name : {"both transforms to the IMU inverted", "transform from camera to camera inverted"}) {
    const CorrectedRig found = corrected(name);
    ASSERT_TRUE(found.rig) << name << ": " << found.why_not;
    expect_right(*found.rig);
    EXPECT_TRUE(found.after.findings.empty()) << name << "\n" << to_text(found.after);
  }
}

TEST(DoctorCorrects, ImagesUpsideDownByTheCalibrationOfSuchImages) {
  const CorrectedRig found = corrected("images upside down");
  ASSERT_TRUE(found.rig) << found.why_not;
  EXPECT_NEAR(degrees_between(found.rig->T_BC0().R(), handheld().rig.T_BC0().R()), 180, 0.5);
  EXPECT_TRUE(found.after.findings.empty()) << to_text(found.after);
}

TEST(DoctorCorrects, WhatIsJudgedAndSaysWhatIsNot) {
  const CorrectedRig found = corrected("mounting wrong by 4 degrees and baseline 12 % too long");
  ASSERT_TRUE(found.rig) << found.why_not;
  EXPECT_LT(degrees_between(found.rig->T_BC0().R(), handheld().rig.T_BC0().R()), 0.5);
  // The rig hardly accelerates, which the length of the baseline would be seen by.
  EXPECT_NE(to_text(found.after).find("length of the baseline: the rig hardly accelerated"), std::string::npos);
}

TEST(DoctorCorrects, MoreAccuratelyThanItMeasures) {
  const CorrectedRig found = corrected("right camera turned 1.5 degrees about z");
  ASSERT_TRUE(found.rig) << found.why_not;
  EXPECT_LT(degrees_between(found.rig->T_C1C0().R(), handheld().rig.T_C1C0().R()), 0.01);
}

TEST(DoctorCorrects, TheLensesOfAnotherImageSize) {
  const StereoRig& images = handheld().rig;
  const ImageSize size{images.left().width(), images.left().height()}, twice{2 * size.width, 2 * size.height};
  const std::vector<ScaledLens> scaled{{0, twice, size}, {1, twice, size}};
  Diagnosis diagnosis = *diagnose(images, handheld().replay(), CalibrationStyle::kalibr);
  tell_of_scaled(scaled, CalibrationStyle::kalibr, diagnosis);
  ASSERT_EQ(diagnosis.findings.size(), 1u) << to_text(diagnosis);
  EXPECT_EQ(diagnosis.findings[0].kind, FindingKind::calibration_size);
  EXPECT_NEAR(diagnosis.findings[0].size, 0.5, 1e-12);
  EXPECT_NE(diagnosis.findings[0].corrected.find("cam0: resolution: [752, 480]\n"), std::string::npos)
      << diagnosis.findings[0].corrected;
  const Result<CorrectedRig> found = correct_rig(images, diagnosis, handheld().replay(), CalibrationStyle::kalibr);
  ASSERT_TRUE(found && found->rig) << found->why_not;
  EXPECT_TRUE(found->after.findings.empty()) << to_text(found->after);
  EXPECT_EQ(found->rig->left().intrinsics(), images.left().intrinsics());
}

TEST(DoctorCorrects, NothingWhereNoCalibrationHelps) {
  EXPECT_EQ(corrected("images mirrored").why_not, "no calibration describes mirrored images");
  EXPECT_FALSE(corrected("gyroscope in degrees").rig);
  const Result<CorrectedRig> good =
      correct_rig(handheld().rig, *diagnose(handheld().rig, handheld().replay(), CalibrationStyle::kalibr), handheld().replay(),
                  CalibrationStyle::kalibr);
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(good->why_not, "nothing is wrong");
}

TEST(DoctorCorrects, NothingThatIsJudgedNoBetter) {
  // The lines of another rig, as a wrong diagnosis would have them.
  const Replay replay = handheld().replay();
  Diagnosis wrong = *diagnose(handheld().rig, replay, CalibrationStyle::kalibr);
  wrong.rig.cameras[1].T_BC.p += Vec3(0, 0.02, 0.03);
  Finding finding;
  finding.kind = FindingKind::baseline_length;
  finding.fields = {CalibrationField::mounting_of_right};
  wrong.findings = {finding};
  const Result<CorrectedRig> refused = correct_rig(handheld().rig, wrong, replay, CalibrationStyle::kalibr);
  ASSERT_TRUE(refused.ok());
  EXPECT_FALSE(refused->rig);
  EXPECT_NE(refused->why_not.find("as much is wrong with the corrected calibration"), std::string::npos) << refused->why_not;
}

}  // namespace corrected_rig_test
}  // namespace fbvins
