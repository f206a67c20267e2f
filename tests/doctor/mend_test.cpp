// SPDX-License-Identifier: Apache-2.0
// A rendered flight with wrong calibrations: common mistakes are told as one cause, and what is offered has been judged.
#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/doctor/mend.hpp"
#include "fbvins/doctor/spoilers.hpp"
#include "fbvins/sim/simulation.hpp"
#include "tests/rendered_recording.hpp"

namespace fbvins {
namespace mend_test {

struct Flight : test::RenderedRecording {
  Replay replay(const Spoiler& spoiler = {}) const {
    return [this, spoiler](const TakeEvent& take) -> Result<void> {
      for (SensorEvent event : events) {
        if (auto* frame = std::get_if<StereoFrame>(&event); frame != nullptr && spoiler.frame) spoiler.frame(*frame);
        if (auto* sample = std::get_if<ImuSample>(&event); sample != nullptr) {
          if (spoiler.lost && spoiler.lost(*sample)) continue;
          if (spoiler.reading) spoiler.reading(*sample);
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

Spoiler spoiler_named(const std::string& name) {
  for (Spoiler& spoiler : spoilers(handheld().rig))
    if (spoiler.name == name) return std::move(spoiler);
  ADD_FAILURE() << "there is no spoiler '" << name << "'";
  return {};
}

StereoRig spoilt_rig(const Spoiler& spoiler) {
  StereoRig rig = handheld().rig;
  if (spoiler.rig) spoiler.rig(rig);
  return rig;
}

double degrees_between(const Mat3& a, const Mat3& b) { return 57.3 * so3_log(Quat(Mat3(a.transpose() * b))).norm(); }

void expect_right(const StereoRig& rig) {
  const StereoRig& right = handheld().rig;
  EXPECT_LT(degrees_between(rig.T_BC0.R(), right.T_BC0.R()), 0.5);
  EXPECT_LT(degrees_between(rig.T_C1C0().R(), right.T_C1C0().R()), 0.1);
  EXPECT_LT((rig.T_C1C0().p - right.T_C1C0().p).norm(), 0.04 * right.T_C1C0().p.norm());
  EXPECT_NEAR(rig.left.focal_px(), right.left.focal_px(), 0.01 * right.left.focal_px());
  EXPECT_NEAR(rig.time_offset_s, right.time_offset_s, 1e-3);
}

/// The first finding, whose kind is the spoiler's, and the mended rig.
Mended mended(const std::string& name) {
  const Spoiler spoiler = spoiler_named(name);
  const StereoRig rig = spoilt_rig(spoiler);
  const Result<Diagnosis> diagnosis = diagnose(rig, handheld().replay(spoiler), CalibrationStyle::kalibr);
  EXPECT_TRUE(diagnosis.ok());
  EXPECT_FALSE(diagnosis->findings.empty()) << name;
  if (!diagnosis->findings.empty()) {
    EXPECT_EQ(diagnosis->findings.front().kind, spoiler.kind) << to_text(*diagnosis, true);
  }
  Result<Mended> out = mend(rig, *diagnosis, handheld().replay(spoiler), CalibrationStyle::kalibr);
  EXPECT_TRUE(out.ok());
  return *std::move(out);
}

TEST(DoctorMends, TransformsInTheOtherDirection) {
  for (const char* name : {"both transforms to the IMU inverted", "transform from camera to camera inverted"}) {
    const Mended found = mended(name);
    ASSERT_TRUE(found.rig) << name << ": " << found.why_not;
    expect_right(*found.rig);
    EXPECT_TRUE(found.after.findings.empty()) << name << "\n" << to_text(found.after);
  }
}

TEST(DoctorMends, ImagesUpsideDownByTheCalibrationOfSuchImages) {
  const Mended found = mended("images upside down");
  ASSERT_TRUE(found.rig) << found.why_not;
  EXPECT_NEAR(degrees_between(found.rig->T_BC0.R(), handheld().rig.T_BC0.R()), 180, 0.5);
  EXPECT_TRUE(found.after.findings.empty()) << to_text(found.after);
}

TEST(DoctorMends, WhatIsJudgedAndSaysWhatIsNot) {
  const Mended found = mended("mounting wrong by 4 degrees and baseline 12 % too long");
  ASSERT_TRUE(found.rig) << found.why_not;
  EXPECT_LT(degrees_between(found.rig->T_BC0.R(), handheld().rig.T_BC0.R()), 0.5);
  // The rig hardly accelerates, which the length of the baseline would be seen by.
  EXPECT_NE(to_text(found.after).find("length of the baseline: the rig hardly accelerated"), std::string::npos);
}

TEST(DoctorMends, MoreAccuratelyThanItMeasures) {
  const Mended found = mended("right camera turned 1.5 degrees about z");
  ASSERT_TRUE(found.rig) << found.why_not;
  EXPECT_LT(degrees_between(found.rig->T_C1C0().R(), handheld().rig.T_C1C0().R()), 0.01);
}

TEST(DoctorMends, TheLensesOfAnotherImageSize) {
  const StereoRig& images = handheld().rig;
  const ImageSize size{images.left.width(), images.left.height()}, twice{2 * size.width, 2 * size.height};
  const std::vector<ScaledLens> scaled{{0, twice, size}, {1, twice, size}};
  Diagnosis diagnosis = *diagnose(images, handheld().replay(), CalibrationStyle::kalibr);
  tell_of_scaled(scaled, CalibrationStyle::kalibr, diagnosis);
  ASSERT_EQ(diagnosis.findings.size(), 1u) << to_text(diagnosis);
  EXPECT_EQ(diagnosis.findings[0].kind, FindingKind::calibration_size);
  EXPECT_NEAR(diagnosis.findings[0].size, 0.5, 1e-12);
  EXPECT_NE(diagnosis.findings[0].corrected.find("cam0: resolution: [752, 480]\n"), std::string::npos)
      << diagnosis.findings[0].corrected;
  const Result<Mended> found = mend(images, diagnosis, handheld().replay(), CalibrationStyle::kalibr);
  ASSERT_TRUE(found && found->rig) << found->why_not;
  EXPECT_TRUE(found->after.findings.empty()) << to_text(found->after);
  EXPECT_EQ(found->rig->left.intrinsics(), images.left.intrinsics());
}

TEST(DoctorMends, NothingWhereNoCalibrationHelps) {
  EXPECT_EQ(mended("images mirrored").why_not, "no calibration describes mirrored images");
  EXPECT_FALSE(mended("gyroscope in degrees").rig);
  const Result<Mended> good = mend(handheld().rig, *diagnose(handheld().rig, handheld().replay(), CalibrationStyle::kalibr),
                                   handheld().replay(), CalibrationStyle::kalibr);
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(good->why_not, "nothing is wrong");
}

TEST(DoctorMends, NothingThatIsJudgedNoBetter) {
  // The lines of another rig, as a wrong diagnosis would have them.
  const Replay replay = handheld().replay();
  Diagnosis wrong = *diagnose(handheld().rig, replay, CalibrationStyle::kalibr);
  wrong.rig.T_BC1.p += Vec3(0, 0.02, 0.03);
  Finding finding;
  finding.kind = FindingKind::baseline_length;
  finding.fields = {CalibrationField::mounting_of_right};
  wrong.findings = {finding};
  const Result<Mended> refused = mend(handheld().rig, wrong, replay, CalibrationStyle::kalibr);
  ASSERT_TRUE(refused.ok());
  EXPECT_FALSE(refused->rig);
  EXPECT_NE(refused->why_not.find("as much is wrong with the corrected calibration"), std::string::npos) << refused->why_not;
}

}  // namespace mend_test
}  // namespace fbvins
