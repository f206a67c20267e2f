// SPDX-License-Identifier: Apache-2.0
// The doctor on synthetic evidence: silent where all is well, and each wrong setup named with its size.
#include "fbvins/doctor/doctor.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fbvins/core/angle.hpp"
#include "fbvins/core/rng.hpp"
#include "tests/support/setup_faults.hpp"
#include "tests/support/synthetic_evidence.hpp"

namespace fbvins {
namespace doctor_test {

const Evidence& good() {
  static const Evidence evidence = test::SyntheticEvidence({}).make();
  return evidence;
}

std::string all_of(const Diagnosis& diagnosis) {
  std::string text;
  for (const Finding& finding : diagnosis.findings) text += to_text(finding) + "\n";
  for (const std::string& line : diagnosis.measured) text += line + "\n";
  for (const std::string& line : diagnosis.not_judged) text += "not judged: " + line + "\n";
  return text;
}

const Finding* find(const Diagnosis& diagnosis, FindingKind kind) {
  for (const Finding& finding : diagnosis.findings)
    if (finding.kind == kind) return &finding;
  return nullptr;
}

/// Evidence of a recording with an injected fault: the gatherer's working rig is right but for the baseline's length.
Evidence spoilt(const SetupFault& fault) {
  Evidence evidence = good();
  if (fault.rig) fault.rig(evidence.rig);
  const double longer = evidence.rig.T_C1C0().p.norm() / evidence.working_rig.T_C1C0().p.norm();
  Vec3& p_BC1 = evidence.working_rig.cameras[1].T_BC.p;
  p_BC1 = evidence.working_rig.T_BC0().p + longer * (p_BC1 - evidence.working_rig.T_BC0().p);
  for (SeenFrame& frame : evidence.frames)
    for (SeenFeature& feature : frame.features) feature.inverse_depth /= longer;
  if (fault.reading)
    for (ImuSample& sample : evidence.imu) fault.reading(sample);
  return evidence;
}

void expect_named(const std::string& name) {
  for (const SetupFault& fault : setup_faults(good().rig)) {
    if (fault.name != name) continue;
    const Diagnosis diagnosis = examine(spoilt(fault));
    const Finding* finding = find(diagnosis, fault.kind);
    ASSERT_NE(finding, nullptr) << name << "\n" << all_of(diagnosis);
    EXPECT_EQ(diagnosis.findings.size(), 1u) << name << "\n" << all_of(diagnosis);
    if (fault.size != 0) {
      EXPECT_NEAR(finding->size, fault.size, fault.tolerance) << all_of(diagnosis);
    }
    return;
  }
  FAIL() << "there is no fault '" << name << "'";
}

TEST(Diagnosis, TheLastLineSaysWhatWasJudged) {
  Diagnosis diagnosis;
  diagnosis.measured = {"gravity"};
  const std::string fine = to_text(diagnosis);
  EXPECT_TRUE(fine.starts_with("not seen: errors below ")) << fine;
  EXPECT_TRUE(fine.ends_with("\nnothing wrong in 1 measurement")) << fine;
  diagnosis.not_judged = {"axes: the rig hardly turned"};
  diagnosis.findings.resize(2);
  const std::string text = to_text(diagnosis);
  EXPECT_NE(text.find("not judged: axes: the rig hardly turned\n"), std::string::npos) << text;
  EXPECT_TRUE(text.ends_with("\n2 findings in 1 measurement; 1 point could not be judged")) << text;
  EXPECT_EQ(text.find("measured: "), std::string::npos);
  EXPECT_NE(to_text(diagnosis, true).find("measured: gravity\n"), std::string::npos);
}

TEST(Doctor, IsSilentWhereAllIsWell) {
  const Diagnosis diagnosis = examine(good());
  EXPECT_TRUE(diagnosis.findings.empty()) << all_of(diagnosis);
  EXPECT_TRUE(diagnosis.not_judged.empty()) << all_of(diagnosis);
}

TEST(Doctor, NamesUnits) {
  expect_named("gyroscope in degrees");
  expect_named("gyroscope converted twice");
  expect_named("accelerometer in g");
}

TEST(Doctor, NamesAxes) {
  expect_named("gyroscope: y with the wrong sign");
  expect_named("gyroscope: axes (y, z, x)");
  expect_named("accelerometer: x and z exchanged");
}

TEST(Doctor, MeasuresTheMounting) {
  expect_named("IMU mounted the other way round");
  expect_named("mounting wrong by 5 degrees about y");
}

TEST(Doctor, MeasuresTheTimeOffset) {
  expect_named("readings stamped +100 ms");
  expect_named("readings stamped +6 ms");
  expect_named("readings stamped since power-on");
}

TEST(Doctor, MeasuresThePairOfCameras) {
  expect_named("right camera turned 1 degree about x");
  expect_named("baseline 10 % too long");
}

TEST(Doctor, MeasuresALens) {
  expect_named("left focal length 5 % too long");
  expect_named("both focal lengths 8 % too long");
}

TEST(Doctor, MeasuresARightImageThatIsLate) {
  const Diagnosis diagnosis = examine(test::SyntheticEvidence({.right_late_s = 0.02}).make());
  const Finding* finding = find(diagnosis, FindingKind::stereo_sync);
  ASSERT_NE(finding, nullptr) << all_of(diagnosis);
  EXPECT_NEAR(finding->size, 20, 2) << all_of(diagnosis);
}

TEST(Doctor, DoesNotBlameCamerasWithoutATriggerForWhatTheirStampsSay) {
  Evidence evidence = test::SyntheticEvidence({.right_late_s = 0.02}).make();
  evidence.untriggered = true;
  const Diagnosis diagnosis = examine(evidence);
  EXPECT_TRUE(diagnosis.findings.empty()) << all_of(diagnosis);
  EXPECT_EQ(diagnosis.not_judged.size(), 1u);
}

TEST(Doctor, NamesRightImagesThatComeWholeImagesLate) {
  Evidence evidence = good();
  evidence.step = {.lag = 1, .as_stamped_px = 5, .in_step_px = 0.3, .period_s = 0.05};
  const Diagnosis diagnosis = examine(evidence);
  ASSERT_EQ(diagnosis.findings.size(), 1u) << all_of(diagnosis);
  EXPECT_EQ(diagnosis.findings.front().kind, FindingKind::stereo_sync);
  EXPECT_EQ(diagnosis.findings.front().size, -50);
}

TEST(Doctor, MeasuresARollingShutter) {
  const Diagnosis diagnosis = examine(test::SyntheticEvidence({.rolling_s = 0.02}).make());
  const Finding* finding = find(diagnosis, FindingKind::rolling_shutter);
  ASSERT_NE(finding, nullptr) << all_of(diagnosis);
  EXPECT_NEAR(finding->size, 20, 2) << all_of(diagnosis);
  EXPECT_NEAR(diagnosis.rig.line_delay_s, 0.02 / 480, 0.002 / 480);
  EXPECT_EQ(finding->corrected,
            fmt::format("cam0/sensor.yaml, cam1/sensor.yaml: line_delay_us: {:.2f}", 1e6 * diagnosis.rig.line_delay_s));
}

TEST(Doctor, ComparesARollingShutterWithTheCalibrations) {
  Evidence evidence = test::SyntheticEvidence({.rolling_s = 0.02}).make();
  evidence.rig.line_delay_s = evidence.working_rig.line_delay_s = 0.02 / 480;
  EXPECT_EQ(find(examine(evidence), FindingKind::rolling_shutter), nullptr);
  evidence.rig.line_delay_s = evidence.working_rig.line_delay_s = 0.01 / 480;
  const Diagnosis diagnosis = examine(evidence);
  const Finding* finding = find(diagnosis, FindingKind::rolling_shutter);
  ASSERT_NE(finding, nullptr) << all_of(diagnosis);
  EXPECT_NEAR(finding->size, 10, 2) << all_of(diagnosis);
  EXPECT_NEAR(diagnosis.rig.line_delay_s, 0.02 / 480, 0.002 / 480);
}

TEST(Doctor, SaysWhatCannotBeJudged) {
  Evidence evidence = good();
  for (SeenFrame& frame : evidence.frames) frame.features = evidence.frames.front().features;  // at rest
  const Diagnosis diagnosis = examine(evidence);
  EXPECT_TRUE(diagnosis.findings.empty()) << all_of(diagnosis);
  EXPECT_FALSE(diagnosis.not_judged.empty());
}

TEST(Doctor, TellsTheAccelerometersScaleFromTheBaselinesLength) {
  expect_named("accelerometer's scale 5 % too large");
  expect_named("accelerometer's scale 7 % too small");
  expect_named("baseline 9 % too short");
}

TEST(Doctor, NamesWhatOneSensorOfTheImuHas) {
  expect_named("gyroscope's bias 0.3 rad/s");
  expect_named("gyroscope: z 15 % too large");
  expect_named("accelerometer 40 ms late");
  expect_named("accelerometer's bias 1.5 m/s^2");
}

TEST(Doctor, NamesThePlaceOfTheCamerasAndNoiseFigures) {
  expect_named("cameras 10 cm from where they are on the IMU");
  expect_named("IMU's noise 100 times too large");
  expect_named("IMU's noise 100 times too small");
}

TEST(Doctor, GivesTheCorrectedLine) {
  Evidence evidence = good();
  for (ImuSample& sample : evidence.imu) sample.t = sample.t + Duration::from_seconds(0.05);
  const Diagnosis diagnosis = examine(evidence, CalibrationStyle::kalibr);
  const Finding* finding = find(diagnosis, FindingKind::time_offset);
  ASSERT_NE(finding, nullptr) << all_of(diagnosis);
  const std::size_t at = finding->corrected.find("timeshift_cam_imu: ");
  ASSERT_NE(at, std::string::npos) << finding->corrected;
  EXPECT_NEAR(std::stod(finding->corrected.substr(at + 19)), 0.05, 1e-3);
}

TEST(Doctor, NoOffsetIsOfferedForReadingsInBlocks) {
  Evidence evidence = good();
  for (std::size_t i = 0; i < evidence.imu.size(); ++i)  // stamped when the block's last one is measured
    evidence.imu[i].t = Time{evidence.imu[0].t.ns} + Duration{5'000'000LL * static_cast<std::int64_t>(i / 10 * 10 + 9)} +
                        Duration{20'000LL * static_cast<std::int64_t>(i % 10)};
  const Diagnosis diagnosis = examine(evidence);
  ASSERT_NE(find(diagnosis, FindingKind::imu_stamps), nullptr) << all_of(diagnosis);
  const Finding* finding = find(diagnosis, FindingKind::time_offset);
  ASSERT_NE(finding, nullptr) << all_of(diagnosis);
  EXPECT_TRUE(finding->corrected.empty()) << finding->corrected;
  EXPECT_EQ(diagnosis.rig.time_offset_s, evidence.rig.time_offset_s);
}

TEST(Doctor, NoOffsetIsOfferedForStampsThatVary) {
  Evidence evidence = good();
  for (ImuSample& sample : evidence.imu) sample.t = sample.t + Duration::from_seconds(0.05);
  for (std::size_t i = 0; i < evidence.stamps.size(); i += 3)
    evidence.stamps[i] = evidence.stamps[i] + Duration::from_seconds(0.012);
  const Diagnosis diagnosis = examine(evidence);
  ASSERT_NE(find(diagnosis, FindingKind::image_stamps), nullptr) << all_of(diagnosis);
  const Finding* finding = find(diagnosis, FindingKind::time_offset);
  ASSERT_NE(finding, nullptr) << all_of(diagnosis);
  EXPECT_TRUE(finding->fields.empty());
  EXPECT_TRUE(finding->corrected.empty()) << finding->corrected;
  EXPECT_EQ(diagnosis.rig.time_offset_s, evidence.rig.time_offset_s);
}

/// What the left camera alone sees of the evidence, without depths.
Evidence one_camera(const test::SyntheticSetup& setup = {}) {
  Evidence evidence = test::SyntheticEvidence(setup).make();
  evidence.rig = evidence.working_rig = with_one_camera(evidence.rig);
  evidence.stereo.clear();
  for (SeenFrame& frame : evidence.frames) {
    frame.has_depths = false;
    for (SeenFeature& feature : frame.features) feature.inverse_depth = 0;
  }
  return evidence;
}

void expect_named(const Evidence& evidence, FindingKind kind, double size, double tolerance) {
  const Diagnosis diagnosis = examine(evidence);
  const Finding* finding = find(diagnosis, kind);
  ASSERT_NE(finding, nullptr) << all_of(diagnosis);
  EXPECT_EQ(diagnosis.findings.size(), 1u) << all_of(diagnosis);
  EXPECT_NEAR(finding->size, size, tolerance) << all_of(diagnosis);
}

TEST(Doctor, MeasuresTheDirectionOfTheBaseline) {
  Evidence evidence = good();
  const Vec3 left = evidence.rig.T_BC0().p, true_right = evidence.rig.T_BC1().p;
  evidence.rig.cameras[1].T_BC.p = left + so3_exp(Vec3(4 * kDegree, 0, 0)) * (true_right - left);
  expect_named(evidence, FindingKind::baseline_direction, 4, 0.4);
  const StereoRig corrected = examine(evidence).rig;
  EXPECT_LT((corrected.T_BC1().p - true_right).norm(), 1.5e-3);
}

TEST(Doctor, SaysWhereMatchesLieFarFromTheirLinesForNoSingleReason) {
  Evidence evidence = good();
  Rng rng(5);
  for (StereoView& view : evidence.stereo)
    for (StereoPoint& point : view.points) point.right.y() += rng.uniform(-6, 6);
  const Diagnosis diagnosis = examine(evidence);
  const Finding* finding = find(diagnosis, FindingKind::epipolar_error);
  ASSERT_NE(finding, nullptr) << all_of(diagnosis);
  EXPECT_GT(finding->size, 1.5);
  EXPECT_LT(finding->size, 6);
  EXPECT_TRUE(finding->fields.empty());
}

TEST(Doctor, NamesReadingsOfAnotherImu) {
  Evidence evidence = good();
  for (ImuSample& sample : evidence.imu) {
    const double t = sample.t.seconds();
    sample.gyro_radps = 0.5 * Vec3(std::sin(0.31 * t * t), std::cos(0.23 * t * t), std::sin(0.19 * t * t + 1));
  }
  const Diagnosis diagnosis = examine(evidence);
  const Finding* finding = find(diagnosis, FindingKind::imu_camera_disagree);
  ASSERT_NE(finding, nullptr) << all_of(diagnosis);
  EXPECT_LT(finding->size, 0.7);
  EXPECT_EQ(find(diagnosis, FindingKind::time_offset), nullptr) << all_of(diagnosis);
}

TEST(DoctorOfOneCamera, IsSilentWhereAllIsWell) {
  const Diagnosis diagnosis = examine(one_camera());
  EXPECT_TRUE(diagnosis.findings.empty()) << all_of(diagnosis);
  ASSERT_TRUE(diagnosis.predicted_px);
  EXPECT_LT(*diagnosis.predicted_px, 0.5);
}

TEST(DoctorOfOneCamera, NamesTimes) {
  test::SyntheticSetup late, rolling;
  late.late_s = 0.04, rolling.rolling_s = 0.02;
  expect_named(one_camera(late), FindingKind::time_offset, 40, 2);
  expect_named(one_camera(rolling), FindingKind::rolling_shutter, 20, 3);
}

TEST(DoctorOfOneCamera, NamesMountingAndGyroscope) {
  Evidence turned = one_camera();
  turned.rig.cameras[0].T_BC.q = (so3_exp(Vec3(0.05, -0.03, 0.04)) * turned.rig.T_BC0().q).normalized();
  expect_named(turned, FindingKind::imu_camera_rotation, 4.05, 0.6);
  Evidence scaled = one_camera(), biased = one_camera(), exchanged = one_camera(), degrees = one_camera();
  for (ImuSample& sample : scaled.imu) sample.gyro_radps *= 1.08;
  expect_named(scaled, FindingKind::gyro_scale, 8, 1);
  for (ImuSample& sample : biased.imu) sample.gyro_radps += Vec3(0.2, -0.1, 0.1);
  expect_named(biased, FindingKind::gyro_bias, 0.26, 0.03);
  for (ImuSample& sample : exchanged.imu) std::swap(sample.gyro_radps.x(), sample.gyro_radps.y());
  EXPECT_NE(find(examine(exchanged), FindingKind::gyro_axes), nullptr) << all_of(examine(exchanged));
  for (ImuSample& sample : degrees.imu) sample.gyro_radps *= 180 / std::numbers::pi;
  EXPECT_NE(find(examine(degrees), FindingKind::gyro_units), nullptr) << all_of(examine(degrees));
}

TEST(DoctorOfOneCamera, NamesTheAccelerometersBiasScaleAndAxes) {
  Evidence biased = one_camera(), scaled = one_camera(), crooked = one_camera();
  for (ImuSample& sample : biased.imu) sample.accel_mps2 += Vec3(1.1, -0.8, 0.9);
  expect_named(biased, FindingKind::accel_bias, 1.65, 0.3);
  for (ImuSample& sample : scaled.imu) sample.accel_mps2 *= 1.15;  // less may be a bias, where the rig hardly turns over
  const Diagnosis found = examine(scaled);
  EXPECT_TRUE(find(found, FindingKind::accel_scale) != nullptr || find(found, FindingKind::accel_bias) != nullptr)
      << all_of(found);
  const Mat3 M = (Mat3() << 1, 0.06, -0.05, 0, 1, 0.06, 0, 0, 1).finished();
  for (ImuSample& sample : crooked.imu) sample.accel_mps2 = M * sample.accel_mps2;
  expect_named(crooked, FindingKind::accel_alignment, 6, 2);
}

TEST(DoctorOfOneCamera, NamesAnAccelerometerOfTheWrongSignOrAxes) {
  Evidence negative = one_camera(), exchanged = one_camera();
  for (ImuSample& sample : negative.imu) sample.accel_mps2 = -sample.accel_mps2;
  for (ImuSample& sample : exchanged.imu) std::swap(sample.accel_mps2.x(), sample.accel_mps2.z());
  for (const auto& [evidence, axes] : {std::pair{&negative, "(-x, -y, -z)"}, std::pair{&exchanged, "(z, y, x)"}}) {
    const Diagnosis found = examine(*evidence);
    const Finding* finding = find(found, FindingKind::accel_axes);
    ASSERT_NE(finding, nullptr) << all_of(found);
    EXPECT_NE(finding->measured.find(axes), std::string::npos) << finding->measured;
  }
}

/// By two cameras, too: the accelerometer's axes of a RealSense before its calibration, and a gyroscope that reads forces.
TEST(Doctor, NamesAxesThatAreNotSquareAndAGyroscopeThatReadsForces) {
  Evidence crooked = good(), forced = good();
  const Mat3 M = (Mat3() << 1, 0.06, -0.05, 0, 1, 0.06, 0, 0, 1).finished();
  for (ImuSample& sample : crooked.imu) sample.accel_mps2 = M * sample.accel_mps2;
  EXPECT_NE(find(examine(crooked), FindingKind::accel_alignment), nullptr) << all_of(examine(crooked));
  const Mat3 A = (Mat3() << 0, 0.008, 0, -0.006, 0, 0.007, 0, 0.006, 0).finished();
  for (ImuSample& sample : forced.imu) sample.gyro_radps += A * (sample.accel_mps2 - Vec3(0, 0, 9.8));
  EXPECT_NE(find(examine(forced), FindingKind::gyro_by_force), nullptr) << all_of(examine(forced));
}

}  // namespace doctor_test
}  // namespace fbvins
