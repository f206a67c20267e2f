// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/camera_calibration.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "fbvins/calibration/simulated_board.hpp"

namespace fbvins {
namespace {

const Board kBoard{.columns = 6, .rows = 6, .size_m = 0.088, .spacing = 0.3};

/// Errors of all parameters, in the order of the covariance.
Eigen::VectorXd errors_of(const CameraCalibration& found, const SimulatedRig& truth) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(found.names.size()));
  Eigen::Index row = 0;
  for (std::size_t k = 0; k < truth.cameras.size(); ++k) {
    const std::vector<double> got = lens_parameters(found.cameras[k].camera.model()), want = lens_parameters(truth.cameras[k].model());
    for (std::size_t i = 0; i < got.size(); ++i) out[row++] = got[i] - want[i];
    if (k == 0) continue;
    out.segment<3>(row) = found.cameras[k].T_CkC0.p - truth.T_CkC0[k].p;
    out.segment<3>(row + 3) = so3_log(truth.T_CkC0[k].q.conjugate() * found.cameras[k].T_CkC0.q);
    row += 6;
  }
  return out;
}

TEST(CameraCalibration, EveryModelIsFoundWithItsCovariance) {
  for (const Camera& left : example_cameras()) {
    const SimulatedRig rig = simulated_stereo(left);
    const SimulatedViews views = simulated_views(rig, kBoard, 60, 0.1, 7);
    const auto found = calibrate_cameras(views.detections, kBoard, {.models = {left.model_name()}});
    ASSERT_TRUE(found) << left.model_name() << ": " << found.error().message;
    EXPECT_NEAR(found->noise_px, 0.1, 0.003) << left.model_name();
    const Eigen::VectorXd error = errors_of(*found, rig);
    ASSERT_EQ(error.size(), found->covariance.rows());
    const double nees = error.dot(found->covariance.ldlt().solve(error)) / static_cast<double>(error.size());
    EXPECT_GT(nees, 0.3) << left.model_name();
    EXPECT_LT(nees, 2.0) << left.model_name();
    for (std::size_t k = 0; k < found->names.size(); ++k)
      EXPECT_LT(std::abs(error[static_cast<Eigen::Index>(k)]), 4 * found->sigma(found->names[k])) << left.model_name() << ' ' << found->names[k];
  }
}

}  // namespace
}  // namespace fbvins
