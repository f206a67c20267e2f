// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/rig_variations.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "fbvins/calibration/imu_camera.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "tests/support/imu_camera_scene.hpp"

namespace fbvins {
namespace rig_variations_test {

/// Lenses known to 0.1 px, the second camera's place to 0.05 mm, everything correlated.
CameraCalibration uncertain(const std::vector<Camera>& cameras, const std::vector<Pose<Cn, C0>>& T_CnC0, Rng& rng) {
  CameraCalibration out;
  std::vector<double> sigma;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    CalibratedCamera camera;
    camera.camera = cameras[c], camera.T_CnC0 = T_CnC0[c];
    out.cameras.push_back(camera);
    for (int i = 0; i < 8; ++i) sigma.push_back(i < 4 ? 0.1 : 2e-4), out.names.push_back(fmt::format("cam{}.lens{}", c, i));
    if (c == 0) continue;
    sigma.insert(sigma.end(), {5e-5, 5e-5, 5e-5, 1e-4, 1e-4, 1e-4});
    for (const char* name : {"px", "py", "pz", "rx", "ry", "rz"}) out.names.push_back(fmt::format("cam{}.{}", c, name));
  }
  const auto n = static_cast<Eigen::Index>(sigma.size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(n, n);
  for (double& x : A.reshaped()) x += 0.2 * rng.normal();
  const Eigen::Map<const Eigen::VectorXd> s(sigma.data(), n);
  out.covariance = s.asDiagonal() * A * A.transpose() * s.asDiagonal();
  return out;
}

Eigen::VectorXd numbers_of(const RigVariation& rig, const CameraCalibration& from) {
  std::vector<double> out;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const std::vector<double> a = lens_parameters(rig.cameras[c].model()), b = lens_parameters(from.cameras[c].camera.model());
    for (std::size_t i = 0; i < a.size(); ++i) out.push_back((a[i] - b[i]) / rig.sigmas);
    if (c == 0) continue;
    const Vec3 p = rig.T_CnC0[c].p - from.cameras[c].T_CnC0.p,
               r = so3_log(from.cameras[c].T_CnC0.q.conjugate() * rig.T_CnC0[c].q);
    for (int i = 0; i < 3; ++i) out.push_back(p(i) / rig.sigmas);
    for (int i = 0; i < 3; ++i) out.push_back(r(i) / rig.sigmas);
  }
  return Eigen::Map<const Eigen::VectorXd>(out.data(), static_cast<Eigen::Index>(out.size()));
}

TEST(RigVariations, AreAFactorOfTheCovariance) {
  Rng rng(1);
  test::HandHeldOptions o;
  o.duration_s = 0.1;
  const auto truth = test::hand_held(o, 1);
  const CameraCalibration rig = uncertain(truth.input.cameras, truth.input.T_CnC0, rng);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(rig.covariance.rows(), rig.covariance.cols());
  for (const RigVariation& v : rig_variations(rig)) {
    const Eigen::VectorXd x = numbers_of(v, rig);
    sum += x * x.transpose();
  }
  const Eigen::VectorXd s = rig.covariance.diagonal().cwiseSqrt();
  EXPECT_LT((s.cwiseInverse().asDiagonal() * (sum - rig.covariance) * s.cwiseInverse().asDiagonal()).norm(), 1e-5);
}

TEST(RigVariations, TheImusCalibrationInheritsThem) {
  Rng rng(2);
  test::HandHeldOptions o;
  o.duration_s = 12, o.image_rate_hz = 10;
  auto recording = test::hand_held(o, 3);
  const auto exact = calibrate_imu_camera(recording.input, {});
  ASSERT_TRUE(exact) << exact.error().message;
  // The lenses that are given are off by a draw of their uncertainty.
  CameraCalibration rig = uncertain(recording.input.cameras, recording.input.T_CnC0, rng);
  const std::vector<RigVariation> around_truth = rig_variations(rig);
  Eigen::VectorXd draw(static_cast<Eigen::Index>(around_truth.size()));
  for (double& x : draw) x = rng.normal();
  for (std::size_t c = 0; c < 2; ++c) {
    std::vector<double> lens = lens_parameters(recording.input.cameras[c].model());
    Vec3 p = Vec3::Zero(), r = Vec3::Zero();
    for (std::size_t k = 0; k < around_truth.size(); ++k) {
      const double by = draw(static_cast<Eigen::Index>(k)) / around_truth[k].sigmas;
      const std::vector<double> other = lens_parameters(around_truth[k].cameras[c].model()),
                                own = lens_parameters(rig.cameras[c].camera.model());
      for (std::size_t i = 0; i < lens.size(); ++i) lens[i] += by * (other[i] - own[i]);
      p += by * (around_truth[k].T_CnC0[c].p - rig.cameras[c].T_CnC0.p);
      r += by * so3_log(rig.cameras[c].T_CnC0.q.conjugate() * around_truth[k].T_CnC0[c].q);
    }
    const Camera& camera = rig.cameras[c].camera;
    recording.input.cameras[c] = Camera(with_parameters(camera.model(), lens.data()), camera.width(), camera.height());
    recording.input.T_CnC0[c] = recording.input.T_CnC0[c].boxplus(p, r);
    rig.cameras[c].camera = recording.input.cameras[c], rig.cameras[c].T_CnC0 = recording.input.T_CnC0[c];
  }
  recording.input.variations = rig_variations(rig);
  const auto found = calibrate_imu_camera(recording.input, {});
  ASSERT_TRUE(found) << found.error().message;
  for (std::size_t c = 0; c < 2; ++c) {
    Vec6 error;
    error << found->cameras[c].T_BC.p - recording.truth.T_BC[c].p,
        so3_log(recording.truth.T_BC[c].q.conjugate() * found->cameras[c].T_BC.q);
    EXPECT_LT(test::squared_sigmas(error, found->cameras[c].covariance), 20) << "camera " << c;
    // A centre known to 0.1 px of a focal length of 458 px is a direction known to 0.2 mrad.
    EXPECT_GT(std::sqrt(found->cameras[c].covariance(3, 3)), 1e-4);
    EXPECT_LT(std::sqrt(exact->cameras[c].covariance(3, 3)), 1e-4);
  }
}

}  // namespace rig_variations_test
}  // namespace fbvins
