// SPDX-License-Identifier: Apache-2.0
// Whole refinements of simulated flights.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fbvins/calibration/flight_calibration.hpp"
#include "fbvins/core/angle.hpp"
#include "tests/support/flight_scene.hpp"

namespace fbvins {
namespace flight_refinement_test {

using test::flight_scene_rig;
using test::FlightSceneOptions;
using test::simulated_flight_tracks;

const RefinedParameter& parameter(const FlightCalibration& found, const std::string& name) {
  const auto it = std::find_if(found.parameters.begin(), found.parameters.end(), [&](const auto& p) { return p.name == name; });
  EXPECT_NE(it, found.parameters.end()) << name;
  return *it;
}

FlightCalibration refined(const StereoRig& truth, const StereoRig& given, const FlightSceneOptions& options = {}) {
  const FlightTracks tracks = simulated_flight_tracks(truth, given.time_offset_s, options);
  Result<FlightCalibration> found = calibrate_from_flights({tracks}, {"flight"}, given, {});
  EXPECT_TRUE(found.ok()) << found.error().message;
  return *std::move(found);
}

TEST(FlightRefinement, AWrongCalibrationIsMended) {
  const StereoRig truth = flight_scene_rig();
  StereoRig given = truth;
  given.cameras[0].T_BC.q = (truth.T_BC0().q * so3_exp(Vec3(0.3, -0.4, 0.2) * kDegree)).normalized();
  given.cameras[0].T_BC.p += Vec3(0.01, -0.015, 0.008);
  given.cameras[1].T_BC = (given.T_BC0() * truth.T_C1C0().inverse()).cast_frames<B, C0>();
  given.cameras[1].T_BC.q = (given.T_BC1().q * so3_exp(Vec3(0.1, 0.05, -0.1) * kDegree)).normalized();
  given.time_offset_s -= 0.003;
  given.cameras[0].camera = given.left().with_lens(PinholeRadtan{462.0, 460.0, 368.5, 247.0, -0.2834, 0.0740, 1.9e-4, 1.8e-5});
  const FlightCalibration found = refined(truth, given);
  EXPECT_TRUE(found.better) << found.verdict;
  const FlightRig exact = flight_rig(truth);
  const Eigen::VectorXd error = step_between(exact, flight_rig(found.rig)), before = step_between(exact, flight_rig(given));
  for (std::size_t i = 0; i < found.parameters.size(); ++i) {
    const RefinedParameter& p = found.parameters[i];
    const auto k = static_cast<Eigen::Index>(i);
    if (p.finding == FlightFinding::not_determined) {
      EXPECT_EQ(p.value, p.given) << p.name;
    } else {
      EXPECT_LT(std::abs(error[k]), 3.5 * p.sigma) << p.name << " " << p.given << " " << p.value;
    }
    if (p.finding == FlightFinding::refined && std::abs(before[k]) > 8 * p.sigma) {
      EXPECT_LT(std::abs(error[k]), 0.5 * std::abs(before[k])) << p.name;
    }
  }
  for (const char* name : {"time_offset", "cam0.imu.rx", "cam0.imu.ry", "cam0.fx", "cam1.rx"})
    EXPECT_EQ(parameter(found, name).finding, FlightFinding::refined) << name;
}

TEST(FlightRefinement, WhatIsRoughAloneIsRefinedHoweverLittle) {
  const StereoRig truth = flight_scene_rig();
  StereoRig given = truth;
  given.cameras[1].T_BC.q = (given.T_BC1().q * so3_exp(Vec3(0.02, -0.02, 0.02) * kDegree)).normalized();
  given.time_offset_s += 0.002;
  const FlightTracks tracks = simulated_flight_tracks(truth, given.time_offset_s, {});
  FlightCalibrationOptions options;
  options.rough = {FlightGroup::between_cameras};
  const Result<FlightCalibration> found = calibrate_from_flights({tracks}, {"flight"}, given, options);
  ASSERT_TRUE(found.ok());
  EXPECT_TRUE(found->better) << found->verdict;
  const auto off = [&](const StereoRig& rig) {
    return so3_log(Quat(Mat3(truth.T_C1C0().R().transpose() * rig.T_C1C0().R()))).norm();
  };
  EXPECT_LT(off(found->rig), 0.4 * off(given));
  EXPECT_EQ(found->rig.time_offset_s, given.time_offset_s) << "is not called rough";
  EXPECT_EQ(found->rig.T_BC0().p, given.T_BC0().p);
}

TEST(FlightRefinement, AGoodCalibrationStaysExactly) {
  const StereoRig truth = flight_scene_rig();
  for (const std::uint64_t seed : {11, 12}) {
    const FlightCalibration found = refined(truth, truth, {.seed = seed});
    EXPECT_FALSE(found.better) << seed;
    EXPECT_NE(found.verdict.find("stays"), std::string::npos) << found.verdict;
    EXPECT_EQ(values(flight_rig(found.rig)), values(flight_rig(truth))) << seed;
  }
}

TEST(FlightRefinement, WithoutMotionTheLeverIsNotDetermined) {
  const StereoRig truth = flight_scene_rig();
  StereoRig given = truth;
  given.cameras[0].T_BC.p += Vec3(0.01, 0, 0);
  given.cameras[1].T_BC.p += Vec3(0.01, 0, 0);
  const FlightCalibration found = refined(truth, given, {.rotation_rad = 0});
  for (const char* name : {"cam0.imu.px", "cam0.imu.py", "cam0.imu.pz"}) {
    EXPECT_EQ(parameter(found, name).finding, FlightFinding::not_determined) << name;
    EXPECT_EQ(parameter(found, name).value, parameter(found, name).given) << name;
  }
}

TEST(FlightRefinement, OneCameraIsMended) {
  const StereoRig truth = with_one_camera(flight_scene_rig());
  StereoRig given = truth;
  given.cameras[0].T_BC.q = (truth.T_BC0().q * so3_exp(Vec3(0.3, -0.4, 0.2) * kDegree)).normalized();
  given.cameras[1].T_BC.q = given.T_BC0().q;
  given.time_offset_s += 0.003;
  const FlightCalibration found = refined(truth, given);
  EXPECT_TRUE(found.better) << found.verdict;
  EXPECT_EQ(found.rig.camera_count(), 1);
  EXPECT_NEAR(found.rig.time_offset_s, truth.time_offset_s, 2e-4);
  EXPECT_LT(so3_log(truth.T_BC0().q.conjugate() * found.rig.T_BC0().q).norm(), 0.1 * kDegree);
}

TEST(FlightRefinement, TheThirdOfThreeCamerasIsMended) {
  StereoRig truth = flight_scene_rig();
  Pose<B, C0> T_BC2 = truth.T_BC0();  // looks backwards
  T_BC2.q = (T_BC2.q * so3_exp(Vec3(0, 180, 0) * kDegree)).normalized();
  T_BC2.p += Vec3(0.02, 0.03, -0.06);
  truth.cameras.push_back({truth.left(), T_BC2});
  StereoRig given = truth;
  given.cameras[2].T_BC.q = (T_BC2.q * so3_exp(Vec3(0.3, -0.2, 0.2) * kDegree)).normalized();
  const FlightCalibration found = refined(truth, given);
  EXPECT_TRUE(found.better) << found.verdict;
  ASSERT_EQ(found.rig.camera_count(), 3);
  const auto off = [&](int camera) {
    const Pose<B, C0> T_BC = found.rig.T_BC(camera);
    return so3_log(truth.T_BC(camera).q.conjugate() * T_BC.q).norm();
  };
  EXPECT_LT(off(2), 0.05 * kDegree);
  EXPECT_LT(off(1), 0.01 * kDegree);
  EXPECT_EQ(parameter(found, "cam2.rx").finding, FlightFinding::refined);
}

TEST(FlightRefinement, SeveralFlightsJudgeOneAnother) {
  const StereoRig truth = flight_scene_rig();
  StereoRig given = truth;
  given.time_offset_s += 0.003;
  std::vector<FlightTracks> flights;
  for (const std::uint64_t seed : {21, 22, 23})
    flights.push_back(simulated_flight_tracks(truth, given.time_offset_s, {.duration_s = 9, .seed = seed}));
  const Result<FlightCalibration> found = calibrate_from_flights(flights, {"a", "b", "c"}, given, {});
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->held_out.size(), 3u);
  for (const HeldOutPart& part : found->held_out) EXPECT_GT(part.gain, 3) << part.name;
  EXPECT_TRUE(found->better);
  EXPECT_NEAR(found->rig.time_offset_s, truth.time_offset_s, 4 * parameter(*found, "time_offset").sigma);
}

}  // namespace flight_refinement_test
}  // namespace fbvins
