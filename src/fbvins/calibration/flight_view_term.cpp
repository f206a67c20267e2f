// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/flight_view_term.hpp"

namespace fbvins {

std::optional<Vec2> view_of(const FlightRig& rig, int camera, const ViewPlace& at, const Vec3& p_W,
                            ViewDerivatives* derivatives) {
  const auto k = static_cast<std::size_t>(camera);
  // The state when the image was taken: rate and acceleration are constant over the milliseconds until then.
  const NavState<W>& s = at.state;
  const double late = at.late_s;
  const Vec3 w = at.reading.gyro_radps - s.bias.gyro_radps;
  const Vec3 a = s.T_FB.q * Vec3(at.reading.accel_mps2 - s.bias.accel_mps2) + level_gravity(at.gravity_mps2);
  const Vec3 v = s.v_FB + late * a;
  const Mat3 R_then = so3_exp(late * w).toRotationMatrix().transpose(), R_BW = s.T_FB.R().transpose();
  const Vec3 p_start = R_BW * (p_W - s.T_FB.p - late * s.v_FB - 0.5 * late * late * a);
  const Vec3 p_B = R_then * p_start;
  const Mat3 R_CB = rig.T_BC0.R().transpose();
  const Vec3 p_C0 = R_CB * (p_B - rig.T_BC0.p);
  const Pose<Cn, C0>& T_CnC0 = rig.T_CnC0[k];
  LensDerivatives lens;
  const auto pixel = project_point(rig.cameras[k].model(), T_CnC0 * p_C0, derivatives != nullptr ? &lens : nullptr);
  if (!pixel || derivatives == nullptr) return pixel;

  const Eigen::Matrix<double, 2, 3> J_C0 = lens.point * T_CnC0.R(), J_B = J_C0 * R_CB;
  const Eigen::Matrix<double, 2, 3> J_start = J_B * R_then, J_W = J_start * R_BW;
  derivatives->point = J_W;
  derivatives->state.leftCols<3>() = -J_W;
  derivatives->state.middleCols<3>(3) = J_start * hat(p_start);
  derivatives->state.rightCols<3>() = -late * J_W;
  auto& J = derivatives->calibration;
  J.middleCols<3>(flight::lever) = -J_B;
  J.middleCols<3>(flight::mounting) = J_C0 * hat(p_C0);
  J.col(ViewDerivatives::kOffset) = -J_B * hat(w) * p_B - J_W * v;
  J.middleCols<3>(ViewDerivatives::kPair) = lens.point;
  J.middleCols<3>(ViewDerivatives::kPair + 3) = -J_C0 * hat(p_C0);
  J.rightCols<kMostLensParameters>() = lens.parameters;
  return pixel;
}

}  // namespace fbvins
