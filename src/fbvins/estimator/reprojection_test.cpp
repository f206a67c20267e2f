// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/reprojection.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"
#include "fbvins/estimator/landmark_prior.hpp"
#include "tests/support/jacobian_check.hpp"

namespace fbvins {
namespace reprojection_test {

struct Seen {
  Calibration calibration{
      {{so3_exp(Vec3(0.1, -1.2, 0.3)), Vec3(0.02, -0.03, 0.01)}, {so3_exp(Vec3(0.12, -1.21, 0.28)), Vec3(0.1, 0.02, -0.04)}},
      0.004,
      2e-5};
  Pose<G, B> host{so3_exp(Vec3(0.3, 0.2, -0.5)), Vec3(1, 2, 3)};
  Pose<G, B> target{so3_exp(Vec3(0.35, 0.1, -0.45)), Vec3(1.2, 1.9, 3.1)};
  WindowLandmark landmark{.alpha_beta_rho = Vec3(0.2, -0.1, 0.4)};
  WindowObservation o;

  Seen() {
    o.normalised = Vec2(0.15, -0.05);
    o.velocity = Vec2(0.3, -0.7);
    o.rows = -150;
    o.sqrt_information << 700, 20, -10, 650;
  }
  /// Moved by (host, target, point, left camera, right camera, time offset, line delay in
  /// units of 0.01 s: the check's steps suit numbers of about one).
  Seen moved(const Eigen::VectorXd& d) const {
    Seen s = *this;
    s.host = host.boxplus(d.segment<3>(0), d.segment<3>(3));
    s.target = target.boxplus(d.segment<3>(6), d.segment<3>(9));
    s.landmark.alpha_beta_rho += d.segment<3>(12);
    s.calibration.cameras[0] = calibration.T_BC0().boxplus(d.segment<3>(15), d.segment<3>(18));
    s.calibration.cameras[1] = calibration.T_BC(1).boxplus(d.segment<3>(21), d.segment<3>(24));
    s.calibration.time_offset_s += d(27);
    s.calibration.line_delay_s += 0.01 * d(28);
    return s;
  }
  /// Fills p_C and r; and the rows of the Jacobian, if wanted.
  Vec2 residual(double (*rows)[32] = nullptr) const {
    const CameraGeometry cameras(calibration);
    PairGeometry pair;
    pair.set(host, target);
    pair.set_first(host, target);
    const Vec3 x_h = scaled_point_in_host(cameras, landmark);
    Vec3 p_C;
    Vec2 r;
    EXPECT_TRUE(reproject(cameras, pair, x_h, landmark.alpha_beta_rho.z(), o, p_C, r));
    if (rows != nullptr) fill_jacobian_rows<32>(cameras, pair, false, landmark, x_h, o, p_C, r, rows);
    return r;
  }
};

TEST(Reprojection, JacobiansAreDerivatives) {
  for (const bool right : {false, true}) {
    Seen s;
    s.o.camera = right;
    double rows[2][32];
    s.residual(rows);
    Eigen::MatrixXd J(2, 29);
    for (int k = 0; k < 2; ++k) {
      for (int c = 0; c < 15; ++c) J(k, c) = rows[k][c];
      for (int c = 0; c < 13; ++c) J(k, 15 + c) = rows[k][kExtrinsic0 + c];
      J(k, 28) = 0.01 * rows[k][kLineDelay];
    }
    const auto check =
        check_jacobian([&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return s.moved(d).residual(); }, J, {{"r", 2}},
                       {{"p_host", 3},
                        {"theta_host", 3},
                        {"p_target", 3},
                        {"theta_target", 3},
                        {"point", 3},
                        {"p_BC0", 3},
                        {"theta_BC0", 3},
                        {"p_BC1", 3},
                        {"theta_BC1", 3},
                        {"time offset", 1},
                        {"line delay", 1}});
    EXPECT_TRUE(check.ok) << (right ? "right: " : "left: ") << check.message;
  }
}

TEST(Reprojection, APointAtInfinityMeasuresRotationAlone) {
  Seen s;
  s.landmark.alpha_beta_rho.z() = 0;
  const Vec2 before = s.residual();
  s.host.p += Vec3(5, 5, 5);
  EXPECT_EQ(s.residual(), before);
}

TEST(Reprojection, BehindTheCameraThereIsNone) {
  Seen s;
  const CameraGeometry cameras(s.calibration);
  PairGeometry pair;
  pair.set(s.host, {s.host.q * so3_exp(Vec3(0, 3.1, 0)), s.host.p});
  Vec3 p_C;
  Vec2 r;
  const Vec3 x_h = scaled_point_in_host(cameras, s.landmark);
  EXPECT_FALSE(reproject(cameras, pair, x_h, s.landmark.alpha_beta_rho.z(), s.o, p_C, r));
}

TEST(LandmarkPrior, JacobiansAreDerivatives) {
  Seen s;
  LandmarkPrior prior;
  prior.p_G = Vec3(2, 2, 4);
  prior.sqrt_information << 40, 5, -3, 0, 25, 2, 0, 0, 60;
  const auto residual = [&](const Seen& at) {
    return landmark_prior_residual(CameraGeometry(at.calibration), at.host, at.landmark, prior);
  };
  const LandmarkPriorJacobian analytic(CameraGeometry(s.calibration), s.host, s.landmark, prior);
  Eigen::MatrixXd J(3, 15);
  J << analytic.host, analytic.point, analytic.extrinsic;
  const auto check = check_jacobian(
      [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
        Eigen::VectorXd all = Eigen::VectorXd::Zero(29);
        all.segment<6>(0) = d.segment<6>(0);
        all.segment<9>(12) = d.segment<9>(6);
        return residual(s.moved(all));
      },
      J, {{"r", 3}}, {{"p_host", 3}, {"theta_host", 3}, {"point", 3}, {"p_BC0", 3}, {"theta_BC0", 3}}, 1e-6);
  EXPECT_TRUE(check.ok) << check.message;
}

}  // namespace reprojection_test
}  // namespace fbvins
