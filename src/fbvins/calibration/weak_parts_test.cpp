// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/weak_parts.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "fbvins/calibration/lens_certainty.hpp"
#include "fbvins/calibration/residual_summary.hpp"
#include "fbvins/calibration/simulated_board.hpp"
#include "tests/support/imu_camera_scene.hpp"

namespace fbvins {
namespace weak_parts_test {

const Board kBoard{.columns = 6, .rows = 6, .size_m = 0.088, .spacing = 0.3};

SimulatedRig one_camera(int kind) { return {{example_cameras()[static_cast<std::size_t>(kind)]}, {{}}}; }

CameraCalibration calibrated(const SimulatedRig& rig, const SimulatedViews& views) {
  const auto found = calibrate_cameras(views.detections, kBoard, {.models = {rig.cameras[0].model_name()}});
  EXPECT_TRUE(found) << found.error().message;
  return found ? *found : CameraCalibration{};
}

std::vector<bool> all_cells(const ImageCells& grid) { return std::vector<bool>(static_cast<std::size_t>(grid.count()), true); }

/// Where rays of the true camera meet the image of the one that was found, less where they truly do; the turn of the camera that
/// explains most of it is taken out.
Eigen::VectorXd moved_pixels(const Camera& found, const Camera& truth, const ImageCells& grid) {
  Eigen::VectorXd moved(2 * grid.count());
  Eigen::MatrixXd turns(2 * grid.count(), 3);
  for (int cell = 0; cell < grid.count(); ++cell) {
    const Vec2 xy = *truth.undistort(grid.centre(cell));
    const Vec3 ray(xy.x(), xy.y(), 1);
    const Vec2 at = *found.project(ray);
    moved.segment<2>(2 * cell) = at - grid.centre(cell);
    for (int axis = 0; axis < 3; ++axis)
      turns.block<2, 1>(2 * cell, axis) = (*found.project(so3_exp(1e-5 * Vec3::Unit(axis)) * ray) - at) / 1e-5;
  }
  return moved - turns * turns.colPivHouseholderQr().solve(moved);
}

TEST(LensCertainty, IsTheErrorThatIsMade) {
  for (const int kind : {0, 4}) {  // omni's parameters trade off against one another
    const SimulatedRig rig = one_camera(kind);
    const ImageCells grid = ImageCells::of(rig.cameras[0]);
    double nees = 0;
    constexpr int kSeeds = 5;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const CameraCalibration found = calibrated(rig, simulated_views(rig, kBoard, 20, 0.2, 400 + static_cast<unsigned>(seed)));
      const std::vector<double> sigma_px = lens_certainty(found, 0, grid, all_cells(grid));
      const Eigen::VectorXd error = moved_pixels(found.cameras[0].camera, rig.cameras[0], grid);
      for (int cell = 0; cell < grid.count(); ++cell)
        nees += error.segment<2>(2 * cell).squaredNorm() /
                (2 * sigma_px[static_cast<std::size_t>(cell)] * sigma_px[static_cast<std::size_t>(cell)]);
    }
    nees /= kSeeds * grid.count();
    EXPECT_GT(nees, 0.4) << kind;
    EXPECT_LT(nees, 2.0) << kind;
  }
}

TEST(WeakParts, NameTheHalfOfTheImageThatTheBoardNeverCameTo) {
  const SimulatedRig rig = one_camera(0);
  SimulatedViews views = simulated_views(rig, kBoard, 60, 0.3, 3);
  EXPECT_TRUE(weak_parts(calibrated(rig, views), nullptr).empty());
  for (BoardView& view : views.detections.views)
    std::erase_if(view.corners, [](const BoardCorner& c) { return c.pixel.x() > 330; });
  std::erase_if(views.detections.views, [](const BoardView& view) { return view.corners.size() < 12; });
  const std::vector<WeakPart> weak = weak_parts(calibrated(rig, views), nullptr);
  ASSERT_EQ(weak.size(), 1u);
  EXPECT_NE(weak[0].what.find("top right, "), std::string::npos) << weak[0].what;
  EXPECT_NE(weak[0].what.find("bottom right"), std::string::npos) << weak[0].what;
  EXPECT_EQ(weak[0].what.find("left"), std::string::npos) << weak[0].what;
  EXPECT_GT(weak[0].sigma, weak[0].aim);
}

TEST(WeakParts, AskForTheTurnsThatWereNotMade) {
  test::HandHeldOptions o;
  o.duration_s = 12, o.image_rate_hz = 10, o.turning = Vec3(1, 0.3, 0.3);
  const auto found = calibrate_imu_camera(test::hand_held(o, 5).input, {});
  ASSERT_TRUE(found) << found.error().message;
  const std::vector<WeakPart> weak = weak_parts({}, &*found, {.lever_m = 1e-4});
  ASSERT_FALSE(weak.empty());
  EXPECT_EQ(weak[0].what, "the place of cam0 on the IMU");
  EXPECT_NE(weak[0].advice.find("y and z"), std::string::npos) << sentence(weak[0]);
  EXPECT_TRUE(weak_parts({}, &*found, {.lever_m = 1, .mounting_rad = 1, .time_offset_s = 1}).empty());
}

TEST(ResidualSummary, SplitsResidualsByPlaceAngleAndTime) {
  const Camera camera(PinholeRadtan{400, 400, 319.5, 239.5, 0, 0, 0, 0}, 640, 480);
  CameraCalibration found;
  found.cameras.push_back({camera, {}, {}, {}, false});
  for (int i = 0; i < 100; ++i) {  // outwards by a thousandth of the distance, along the row of the centre
    const double u = 5.0 * i;
    found.residuals.push_back({Time{i < 50 ? 1 : 2}, 0, i, Vec2(u, 239.5), Vec2(1e-3 * (u - 319.5), 0)});
  }
  const std::vector<CameraResiduals> seen = summarise_residuals(found);
  ASSERT_EQ(seen.size(), 1u);
  const CameraResiduals& r = seen[0];
  EXPECT_EQ(r.grid.columns, 16);
  EXPECT_EQ(r.grid.rows, 12);
  EXPECT_EQ(r.grid.cell_of(r.grid.centre(57)), 57);
  ASSERT_EQ(r.by_view.size(), 2u);
  EXPECT_EQ(r.by_view[0].corners, 50);
  EXPECT_GT(r.by_view[0].rms_px, r.by_view[1].rms_px);
  int corners = 0;
  for (const ResidualBin& bin : r.by_radius) corners += bin.corners;
  EXPECT_EQ(corners, 100);
  EXPECT_NEAR(r.by_radius.back().outwards_px, 0.5e-3 * (r.by_radius.back().from + r.by_radius.back().to), 0.01);
  EXPECT_NEAR(r.by_angle.back().to, std::atan(319.5 / 400), 1e-9);
  EXPECT_LT(r.cells[static_cast<std::size_t>(r.grid.cell_of({2, 239.5}))].mean_px.x(), -0.29);
}

}  // namespace weak_parts_test
}  // namespace fbvins
