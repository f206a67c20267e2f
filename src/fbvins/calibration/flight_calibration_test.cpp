// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/flight_calibration.hpp"

#include <gtest/gtest.h>

#include "fbvins/calibration/flight_piece.hpp"
#include "tests/support/flight_scene.hpp"

namespace fbvins {
namespace flight_calibration_test {

using test::flight_scene_rig;

using test::simulated_flight_tracks;

/// A small change of every parameter, in parts of what is expected of a calibration.
Eigen::VectorXd small_step(const FlightRig& rig, double part, std::uint64_t seed) {
  Rng rng(seed);
  const std::vector<FlightParameter> parameters = flight_parameters(rig);
  Eigen::VectorXd step(static_cast<Eigen::Index>(parameters.size()));
  for (Eigen::Index i = 0; i < step.size(); ++i)
    step[i] = part * parameters[static_cast<std::size_t>(i)].prior_sigma * rng.normal();
  return step;
}

TEST(FlightRig, AStepLeadsToTheRigThatItIsTheStepTo) {
  const FlightRig rig = flight_rig(flight_scene_rig());
  const Eigen::VectorXd step = small_step(rig, 1, 7);
  EXPECT_EQ(static_cast<std::size_t>(step.size()), static_cast<std::size_t>(values(rig).size()));
  EXPECT_LT((step_between(rig, moved(rig, step)) - step).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(flight_parameters(rig)[static_cast<std::size_t>(flight::first_of(rig, 1))].name, "cam1.px");
}

TEST(FlightRig, AStereoRigAndBack) {
  const StereoRig rig = flight_scene_rig(), back = refined_rig(rig, flight_rig(rig));
  EXPECT_LT((back.T_BC1().p - rig.T_BC1().p).norm(), 1e-15);
  EXPECT_LT(so3_log(back.T_BC1().q.conjugate() * rig.T_BC1().q).norm(), 1e-15);
  EXPECT_EQ(back.time_offset_s, rig.time_offset_s);
  EXPECT_EQ(back.left().intrinsics(), rig.left().intrinsics());
}

TEST(FlightView, DerivativesAreThoseOfDifferences) {
  const FlightRig rig = flight_rig(flight_scene_rig());
  const test::Motion motion;
  const ViewPlace at{
      motion.state(3.0, {{0.01, 0.02, -0.01}, Vec3::Zero()}), {motion.rate_B(3.0), motion.specific_force_B(3.0)}, 9.81, 0.003};
  const Vec3 p_W = at.state.T_FB * (rig.T_BC0 * Vec3(0.4, -0.3, 2.5));
  ViewDerivatives d;
  const auto pixel = view_of(rig, 1, at, p_W, &d);
  ASSERT_TRUE(pixel);
  const double h = 1e-6;
  for (int i = 0; i < 9; ++i) {
    Vec15 step = Vec15::Zero();
    step[i] = h;
    ViewPlace moved_place = at;
    moved_place.state = at.state.boxplus(step);
    const Vec2 change = (*view_of(rig, 1, moved_place, p_W) - *pixel) / h;
    EXPECT_LT((change - d.state.col(i)).norm(), 2e-2 + 1e-3 * change.norm()) << i;
  }
  for (int i = 0; i < 3; ++i)
    EXPECT_LT(((*view_of(rig, 1, at, p_W + h * Vec3::Unit(i)) - *pixel) / h - d.point.col(i)).norm(), 2e-3);
  ViewPlace later = at;
  later.late_s += h;
  EXPECT_LT(((*view_of(rig, 1, later, p_W) - *pixel) / h - d.calibration.col(ViewDerivatives::kOffset)).norm(), 1);
  const std::vector<FlightParameter> parameters = flight_parameters(rig);
  const int pair = flight::first_of(rig, 1);
  for (int i = 0; i < 6; ++i) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(values(rig).size());
    step[i] = h;
    EXPECT_LT(((*view_of(moved(rig, step), 1, at, p_W) - *pixel) / h - d.calibration.col(i)).norm(), 2e-2) << i;
    step.setZero();
    step[pair + i] = h;
    EXPECT_LT(((*view_of(moved(rig, step), 1, at, p_W) - *pixel) / h - d.calibration.col(ViewDerivatives::kPair + i)).norm(),
              2e-2)
        << i;
  }
}

TEST(FlightPiece, EquationsPredictHowTheCostFalls) {
  const StereoRig rig = flight_scene_rig();
  const FlightTracks tracks =
      simulated_flight_tracks(rig, rig.time_offset_s, {.duration_s = 6, .noise_px = 0.05});  // far within the loss
  const FlightRig truth = flight_rig(rig);
  FlightPiece piece(tracks.keyframes, tracks.noise, tracks.gravity_mps2, truth);
  EXPECT_GT(piece.points(), 50);
  piece.set_noise({.sigma_px = 0.3});
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(values(truth).size());
  for (int i = 0; i < 8; ++i) (void)piece.linearise(truth, 1e-9), piece.move(none);
  const CalibrationEquations e = piece.linearise(truth, 1e-9);
  EXPECT_NEAR(e.cost, piece.cost(truth), 1e-6 * e.cost);
  // States and points follow a step of the calibration: to the minimum there, by the second-order prediction.
  const Eigen::VectorXd step = small_step(truth, 0.01, 3);
  piece.move(step);
  const FlightRig there = moved(truth, step);
  for (int i = 0; i < 4; ++i) (void)piece.linearise(there, 1e-9), piece.move(none);
  const double predicted = e.gradient.dot(step) + 0.5 * step.dot(e.information * step);
  EXPECT_GT(predicted, 5);
  EXPECT_NEAR(piece.cost(there) - e.cost, predicted, 0.1 * predicted);
}

TEST(FlightCalibration, AWrongTimeOffsetIsMended) {
  const StereoRig truth = flight_scene_rig();
  StereoRig given = truth;
  given.time_offset_s += 0.003;
  const FlightTracks tracks = simulated_flight_tracks(truth, given.time_offset_s, {.duration_s = 11});
  const Result<FlightCalibration> found = calibrate_from_flights({tracks}, {"flight"}, given, {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_TRUE(found->better) << found->verdict;
  EXPECT_NEAR(found->rig.time_offset_s, truth.time_offset_s, 2e-4);
  EXPECT_EQ(found->rig.left().intrinsics(), given.left().intrinsics());
}

TEST(FlightCalibration, WhatCannotBeUsedIsSaidInASentence) {
  const StereoRig rig = flight_scene_rig();
  const FlightTracks tracks = simulated_flight_tracks(rig, rig.time_offset_s, {.duration_s = 8});
  const auto message = [&](const FlightTracks& flight, const StereoRig& with) {
    const Result<FlightCalibration> found = calibrate_from_flights({flight}, {"flight"}, with, {});
    return found ? std::string() : found.error().message;
  };
  EXPECT_EQ(message(tracks, rig).find("flight: "), 0u);
  EXPECT_NE(message(tracks, rig).find("too short: 10 s"), std::string::npos) << message(tracks, rig);
  EXPECT_NE(message({}, rig).find("no pose could be estimated"), std::string::npos);
  StereoRig rolling = rig;
  rolling.line_delay_s = 1e-5;
  EXPECT_NE(message(tracks, rolling).find("rolling shutter"), std::string::npos);
  FlightTracks untriggered = tracks;
  untriggered.untriggered = true;
  EXPECT_NE(message(untriggered, rig).find("trigger"), std::string::npos);
}

}  // namespace flight_calibration_test
}  // namespace fbvins
