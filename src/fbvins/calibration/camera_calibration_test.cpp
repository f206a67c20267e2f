// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/camera_calibration.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/calibration/simulated_board.hpp"

namespace fbvins {
namespace camera_calibration_test {

const Board kBoard{.columns = 6, .rows = 6, .size_m = 0.088, .spacing = 0.3};

/// Errors of all parameters, in the order of the covariance.
Eigen::VectorXd errors_of(const CameraCalibration& found, const SimulatedRig& truth) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(found.names.size()));
  Eigen::Index row = 0;
  for (std::size_t k = 0; k < truth.cameras.size(); ++k) {
    const std::vector<double> got = lens_parameters(found.cameras[k].camera.model()),
                              want = lens_parameters(truth.cameras[k].model());
    for (std::size_t i = 0; i < got.size(); ++i) out[row++] = got[i] - want[i];
    if (k == 0) continue;
    out.segment<3>(row) = found.cameras[k].T_CnC0.p - truth.T_CnC0[k].p;
    out.segment<3>(row + 3) = so3_log(truth.T_CnC0[k].q.conjugate() * found.cameras[k].T_CnC0.q);
    row += 6;
  }
  return out;
}

/// NEES for each degree of freedom, of lenses in parameters in which the valley of ds and omni-radtan is straight.
double nees_of(const CameraCalibration& found, const SimulatedRig& truth) {
  Eigen::VectorXd error = errors_of(found, truth);
  Eigen::MatrixXd J = Eigen::MatrixXd::Identity(error.size(), error.size());
  Eigen::Index row = 0;
  for (std::size_t k = 0; k < truth.cameras.size(); ++k) {
    const LensModel &got = found.cameras[k].camera.model(), &want = truth.cameras[k].model();
    const std::vector<double> a = straight_parameters(got), b = straight_parameters(want);
    const auto n = static_cast<Eigen::Index>(a.size());
    for (Eigen::Index i = 0; i < n; ++i) error[row + i] = a[static_cast<std::size_t>(i)] - b[static_cast<std::size_t>(i)];
    J.block(row, row, n, n) = straight_jacobian(got);
    row += k == 0 ? n : n + 6;
  }
  const Eigen::MatrixXd covariance = J * found.covariance * J.transpose();
  return error.dot(covariance.ldlt().solve(error)) / static_cast<double>(error.size());
}

/// How far two lenses' images of a ray are apart, at most, within nine tenths of the image.
double farthest_px(const Camera& a, const Camera& b) {
  double farthest = 0;
  for (int i = -9; i <= 9; ++i)
    for (int j = -9; j <= 9; ++j) {
      const auto n = b.undistort({(0.5 + 0.05 * i) * (b.width() - 1), (0.5 + 0.05 * j) * (b.height() - 1)});
      const auto p = n ? a.project(n->homogeneous()) : std::nullopt, q = n ? b.project(n->homogeneous()) : std::nullopt;
      farthest = std::max(farthest, p && q ? (*p - *q).norm() : 1e9);
    }
  return farthest;
}

TEST(CameraCalibration, EveryModelIsFoundWithItsCovariance) {
  for (const Camera& left : example_cameras()) {
    const SimulatedRig rig = simulated_stereo(left);
    const SimulatedViews views = simulated_views(rig, kBoard, 40, 0.1, 7);
    const auto found = calibrate_cameras(views.detections, kBoard, {.models = {left.model_name()}});
    ASSERT_TRUE(found) << left.model_name() << ": " << found.error().message;
    EXPECT_NEAR(found->noise_px, 0.1, 0.003) << left.model_name();
    const Eigen::VectorXd error = errors_of(*found, rig);
    ASSERT_EQ(error.size(), found->covariance.rows());
    if (std::holds_alternative<PinholeRational>(left.model())) {
      // Its numerator and denominator trade off against one another along a valley that bends: the lens is known, they are not.
      EXPECT_LT(farthest_px(found->cameras[0].camera, left), 0.1);
    } else {
      const double nees = nees_of(*found, rig);
      EXPECT_GT(nees, 0.3) << left.model_name();
      EXPECT_LT(nees, 2.0) << left.model_name();
    }
    for (std::size_t k = 0; k < found->names.size(); ++k)
      EXPECT_LT(std::abs(error[static_cast<Eigen::Index>(k)]), 4 * found->sigma(found->names[k]))
          << left.model_name() << ' ' << found->names[k];
  }
}

/// The right camera exposes a little earlier or later: 0.4 mrad of the rig's turning, the same for all corners of its image.
TEST(CameraCalibration, WhatMovesAllCornersOfAnImageIsInTheCovariance) {
  double nees = 0, scatter = 0;
  constexpr int kSeeds = 6;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const SimulatedRig rig = simulated_stereo(example_cameras()[0]);
    Rng rng(static_cast<std::uint64_t>(100 + seed));
    SimulatedViews views = simulated_views(rig, kBoard, 40, 0.1, static_cast<std::uint64_t>(seed));
    std::erase_if(views.detections.views, [](const BoardView& v) { return v.camera == 1; });
    for (std::size_t i = 0; i < views.T_C0T.size(); ++i) {
      SimulatedRig turned = rig;
      turned.T_CnC0[1] = rig.T_CnC0[1].boxplus(Vec3::Zero(), 4e-4 * Vec3(rng.normal(), rng.normal(), rng.normal()));
      const Time t{1'000'000'000 + static_cast<std::int64_t>(i) * 50'000'000};
      BoardView view = simulated_view(turned, 1, kBoard, views.T_C0T[i], t, 0.1, rng);
      if (!view.corners.empty()) views.detections.views.push_back(std::move(view));
    }
    const auto found = calibrate_cameras(views.detections, kBoard, {.models = {"pinhole-radtan"}});
    ASSERT_TRUE(found) << found.error().message;
    const Eigen::VectorXd error = errors_of(*found, rig);
    nees += error.dot(found->covariance.ldlt().solve(error)) / static_cast<double>(error.size()) / kSeeds;
    scatter += found->scatter / kSeeds;
  }
  EXPECT_GT(scatter, 3);
  EXPECT_GT(nees, 0.5);
  EXPECT_LT(nees, 3) << "69 where each block of the covariance is scaled, more without";
}

/// One camera of the first kind.
SimulatedRig one_camera() { return {{example_cameras()[0]}, {{}}}; }
const CameraCalibrationOptions kRadtan{.models = {"pinhole-radtan"}};

std::string refusal(const Detections& detections, const Board& board, const CameraCalibrationOptions& options = kRadtan) {
  const auto found = calibrate_cameras(detections, board, options);
  return found ? fmt::format("calibrated to {} px", found->noise_px) : found.error().message;
}

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(CameraCalibration, OutliersAndWrongViewsAreLeftOut) {
  const SimulatedRig rig = one_camera();
  SimulatedViews views = simulated_views(rig, kBoard, 40, 0.1, 3);
  Rng rng(5);
  int spoilt = 0;
  for (std::size_t i = 0; i < views.detections.views.size(); ++i)
    for (BoardCorner& corner : views.detections.views[i].corners)
      if (i % 10 == 9 || rng.uniform() < 0.02) {  // a tenth of the images is nonsense, 2 % of all corners are off
        corner.pixel += Vec2(rng.uniform(-15, 15), rng.uniform(-15, 15));
        corner.pixel = corner.pixel.cwiseMax(0).cwiseMin(Vec2(751, 479));
        ++spoilt;
      }
  const auto found = calibrate_cameras(views.detections, kBoard, kRadtan);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->noise_px, 0.1, 0.003);
  EXPECT_LE(found->cameras[0].statistics.views, 37);
  EXPECT_GT(found->cameras[0].statistics.left_out, 50);
  const Eigen::VectorXd error = errors_of(*found, rig);
  EXPECT_LT(error.dot(found->covariance.ldlt().solve(error)) / static_cast<double>(error.size()), 2.5);
}

TEST(CameraCalibration, CamerasAreChainedThroughOthers) {
  // cam0 and cam2 look apart by 80 degrees; both share a part of their views with cam1.
  SimulatedRig rig = simulated_stereo(example_cameras()[1]);
  rig.cameras.push_back(rig.cameras[0]);
  rig.T_CnC0[1] = {so3_exp(Vec3(0, 0.7, 0)), Vec3(-0.05, 0, 0.02)};
  rig.T_CnC0.push_back({so3_exp(Vec3(0, 1.4, 0)), Vec3(-0.06, 0.01, 0.08)});
  SimulatedViews views = simulated_views(rig, kBoard, 60, 0.1, 11);
  std::erase_if(views.detections.views, [&](const BoardView& v) {  // never cam0 and cam2 together
    const auto pair = (v.t.ns / 50'000'000) % 2;
    return v.camera == (pair == 0 ? 2 : 0);
  });
  const auto found = calibrate_cameras(views.detections, kBoard, {.models = {"pinhole-equidistant"}});
  ASSERT_TRUE(found) << found.error().message;
  const Eigen::VectorXd error = errors_of(*found, rig);
  EXPECT_LT(error.dot(found->covariance.ldlt().solve(error)) / static_cast<double>(error.size()), 2);
  EXPECT_LT((found->cameras[2].T_CnC0.p - rig.T_CnC0[2].p).norm(), 3e-4);

  std::erase_if(views.detections.views, [](const BoardView& v) { return v.camera == 1 && (v.t.ns / 50'000'000) % 2 == 1; });
  EXPECT_TRUE(holds(refusal(views.detections, kBoard, {.models = {"pinhole-equidistant"}}),
                    "cam2 never sees the board at the same time"));
}

TEST(CameraCalibration, CamerasWithoutCommonViewsAreFoundEachByItself) {
  const SimulatedRig rig = simulated_stereo(example_cameras()[1]);
  SimulatedViews views = simulated_views(rig, kBoard, 60, 0.1, 37);
  EXPECT_TRUE(cameras_connected(views.detections, kBoard, 1e-3));
  std::erase_if(views.detections.views, [](const BoardView& v) { return v.camera == (v.t.ns / 50'000'000) % 2; });
  EXPECT_FALSE(cameras_connected(views.detections, kBoard, 1e-3));
  const auto found = calibrate_cameras_apart(views.detections, kBoard, {.models = {"pinhole-equidistant"}});
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->cameras.size(), 2u);
  ASSERT_EQ(found->names.size(), 16u);
  EXPECT_EQ(found->names[8], "cam1.fx");
  for (std::size_t k = 0; k < 2; ++k) {
    const double error = lens_parameters(found->cameras[k].camera.model())[0] - lens_parameters(rig.cameras[k].model())[0];
    EXPECT_LT(std::abs(error), 4 * found->sigma(fmt::format("cam{}.fx", k))) << k;
  }
  std::erase_if(views.detections.views, [](const BoardView& v) { return v.camera == 1 && v.t.ns > 1'400'000'000; });
  const auto refused = calibrate_cameras_apart(views.detections, kBoard, {.models = {"pinhole-equidistant"}});
  ASSERT_FALSE(refused);
  EXPECT_TRUE(holds(refused.error().message, "cam1 sees the board in 5 images, too few")) << refused.error().message;
}

TEST(CameraCalibration, FewerViewsAreUsedThanThereAre) {
  const SimulatedRig rig = one_camera();
  const SimulatedViews views = simulated_views(rig, kBoard, 120, 0.1, 13);
  const auto some = calibrate_cameras(views.detections, kBoard, {.models = {"pinhole-radtan"}, .max_views = 40});
  const auto all = calibrate_cameras(views.detections, kBoard, kRadtan);
  ASSERT_TRUE(some && all);
  EXPECT_EQ(some->poses.size(), 40u);
  EXPECT_EQ(all->poses.size(), 120u);
  // A third of the views, chosen, has more than a third of the information.
  EXPECT_LT(some->sigma("cam0.fx"), 1.5 * all->sigma("cam0.fx"));
}

TEST(CameraCalibration, TheModelIsChosenByWhatItPredicts) {
  for (const std::size_t kind : {0u, 2u}) {
    const SimulatedRig rig{{example_cameras()[kind]}, {{}}};
    const SimulatedViews views = simulated_views(rig, kBoard, 24, 0.1, 17 + kind);
    const auto found = calibrate_cameras(views.detections, kBoard, {.models = {"auto"}});
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(found->cameras[0].camera.model_name(), rig.cameras[0].model_name());
    EXPECT_EQ(found->cameras[0].held_out_px.size(), lens_names().size());
  }
}

TEST(CameraCalibration, TheSameInputGivesTheSameNumbers) {
  const SimulatedViews views = simulated_views(one_camera(), kBoard, 12, 0.1, 19);
  const auto a = calibrate_cameras(views.detections, kBoard, kRadtan), b = calibrate_cameras(views.detections, kBoard, kRadtan);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(lens_parameters(a->cameras[0].camera.model()), lens_parameters(b->cameras[0].camera.model()));
  EXPECT_EQ(a->covariance, b->covariance);
}

TEST(CameraCalibration, WithoutTheImagesSizeTheSmallestUsualOneIsTaken) {
  SimulatedViews views = simulated_views(one_camera(), kBoard, 30, 0.1, 23);
  views.detections.sizes.clear();
  const auto found = calibrate_cameras(views.detections, kBoard, kRadtan);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->cameras[0].camera.width(), 752);
  EXPECT_EQ(found->cameras[0].camera.height(), 480);
  EXPECT_TRUE(found->cameras[0].size_guessed);
  EXPECT_TRUE(holds(found->remarks.at(0), "752 x 480 is assumed"));
}

TEST(CameraCalibration, WhatCannotBeDeterminedIsRefused) {
  const SimulatedRig rig = one_camera();
  EXPECT_TRUE(holds(refusal(simulated_views(rig, kBoard, 3, 0.1, 1).detections, kBoard), "in 3 images, too few"));
  // The board always parallel to the image: focal length and distance cannot be told apart.
  SimulatedViews flat;
  Rng rng(2);
  flat.detections.sizes[0] = {752, 480};
  for (int i = 0; i < 30; ++i) {
    const Pose<C0, T> T_C0T(Quat(0, 1, 0, 0), Vec3(rng.uniform(-0.5, 0), rng.uniform(0.2, 0.5), rng.uniform(0.8, 1.2)));
    flat.detections.views.push_back(simulated_view(rig, 0, kBoard, T_C0T, Time{(i + 1) * 1'000'000ll}, 0.1, rng));
  }
  EXPECT_TRUE(holds(refusal(flat.detections, kBoard), "the views do not determine")) << refusal(flat.detections, kBoard);
}

TEST(CameraCalibration, AnotherBoardIsRefused) {
  const Board tall{.columns = 5, .rows = 7, .size_m = 0.088, .spacing = 0.3};
  const SimulatedViews views = simulated_views(one_camera(), tall, 30, 0.1, 29);
  Board other = tall;
  std::swap(other.columns, other.rows);
  EXPECT_TRUE(holds(refusal(views.detections, other), "with 5 columns and 7 rows they would"))
      << refusal(views.detections, other);
  other = tall;
  other.spacing = 0.2;
  EXPECT_TRUE(holds(refusal(views.detections, other), "with a tagSpacing of 0.3 they would")) << refusal(views.detections, other);
  other = tall;
  other.rows = 4;
  EXPECT_TRUE(holds(refusal(views.detections, other), "the file describes another board"));
}

TEST(CameraCalibration, WrongInputIsRefusedWithOneSentence) {
  const SimulatedRig stereo = simulated_stereo(example_cameras()[0]);
  const SimulatedViews views = simulated_views(stereo, kBoard, 20, 0.1, 31);
  EXPECT_TRUE(holds(refusal(views.detections, kBoard, {.models = {"fov"}}), "'fov' is no lens model"));
  EXPECT_TRUE(holds(refusal({}, kBoard), "found in no image"));
  Detections spoilt = views.detections;
  std::erase_if(spoilt.views, [](const BoardView& v) { return v.camera == 0; });
  EXPECT_TRUE(holds(refusal(spoilt, kBoard), "cam0 never sees the board"));
  spoilt = views.detections;
  spoilt.sizes[0] = {640, 480};
  EXPECT_TRUE(holds(refusal(spoilt, kBoard), "outside of images of 640 x 480"));
  spoilt = views.detections;
  for (BoardView& view : spoilt.views)
    for (BoardCorner& corner : view.corners)
      if (view.camera == 1) corner.pixel.x() = 751 - corner.pixel.x();
  EXPECT_TRUE(holds(refusal(spoilt, kBoard), "the images of one of them are mirrored")) << refusal(spoilt, kBoard);
  spoilt = views.detections;  // the right images are those of the stamp before
  for (BoardView& view : spoilt.views)
    if (view.camera == 1) view.t = view.t + Duration{50'000'000};
  EXPECT_TRUE(holds(refusal(spoilt, kBoard), "were not taken at the same time")) << refusal(spoilt, kBoard);
  spoilt = views.detections;  // one camera's images under two names
  std::erase_if(spoilt.views, [](const BoardView& v) { return v.camera == 1; });
  for (std::size_t i = 0, n = spoilt.views.size(); i < n; ++i) {
    spoilt.views.push_back(spoilt.views[i]);
    spoilt.views.back().camera = 1;
  }
  EXPECT_TRUE(holds(refusal(spoilt, kBoard), "cam0 and cam1 are in one place")) << refusal(spoilt, kBoard);
}

}  // namespace camera_calibration_test
}  // namespace fbvins
