// SPDX-License-Identifier: Apache-2.0
// What images and readings contribute to the problem (docs/derivations/calibration.md, C1-C8).
#include <Eigen/Cholesky>

#include "fbvins/calibration/imu_camera_problem.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

constexpr double kNearest_m = 0.01;
constexpr double kLatest_s = 0.01;  // of an image whose stamp is not exact
constexpr double kJitters = 1.5;    // squared sigmas along the motion above which stamps are not exact
constexpr double kUnseenCost = 50;  // of a corner that the estimate puts behind the lens: any constant

}  // namespace

void ImuCameraProblem::begin_local(int rows, int first_knot) {
  index_.clear();
  J_.setZero(rows, 96);
  for (int k = 0; k < kSplineOrder; ++k) columns(knot_index(first_knot + k), 6);
}

int ImuCameraProblem::columns(int index, int count) {
  const int begin = static_cast<int>(index_.size());
  for (int i = 0; i < count; ++i) index_.push_back(index + i);
  return begin;
}

double ImuCameraProblem::taken_s(const CalibrationView& view) const {
  return view.t_s + state_.time_offset_s + state_.later_s[static_cast<std::size_t>(view.camera)] + state_.line_delay_s * view.row;
}

ImuCameraProblem::ViewMotion ImuCameraProblem::view_motion(const CalibrationView& view, SplineJacobian* J) const {
  const Pose<B, Cn>& T_BC = state_.T_BC[static_cast<std::size_t>(view.camera)];
  const SplineMotion m = state_.path.at(taken_s(view), J);
  ViewMotion out{m.T_TB, (m.T_TB * T_BC).inverse(), Vec6::Zero()};
  out.rate << out.T_CT.q * (m.v_TB + m.T_TB.q * m.w_TB_B.cross(T_BC.p)), T_BC.q.conjugate() * m.w_TB_B;
  return out;
}

std::optional<Vec3> ImuCameraProblem::corner_in_camera(const CalibrationView& view, const WeightedCorner& corner,
                                                       const ViewMotion& motion, double late_s) const {
  Vec3 p_C = motion.T_CT * corner.p_T;
  late_s += state_.line_delay_s * (corner.row - view.row);
  if (late_s != 0) p_C += late_s * (p_C.cross(motion.rate.tail<3>()) - motion.rate.head<3>());
  const Camera& camera = data_.cameras[static_cast<std::size_t>(view.camera)];
  if (p_C.z() < kNearest_m || (p_C.head<2>() / p_C.z()).norm() > camera.max_normalised_radius()) return std::nullopt;
  return p_C;
}

double ImuCameraProblem::lateness_s(const CalibrationView& view) const {
  const ViewMotion motion = view_motion(view, nullptr);
  const ViewTerm term = view_term(view, motion, nullptr);
  const Vec6 Hx = term.H.topLeftCorner<6, 6>() * motion.rate;
  return -motion.rate.dot(term.b.head<6>()) / (motion.rate.dot(Hx) + 1 / (kLatest_s * kLatest_s));
}

std::optional<Vec2> ImuCameraProblem::corner_error(const CalibrationView& view, const WeightedCorner& corner,
                                                   double late_s) const {
  const std::optional<Vec3> p_C = corner_in_camera(view, corner, view_motion(view, nullptr), late_s);
  if (!p_C) return std::nullopt;
  return Vec2(data_.cameras[static_cast<std::size_t>(view.camera)].distort(p_C->head<2>() / p_C->z()) - corner.pixel);
}

ImuCameraProblem::ViewTerm ImuCameraProblem::view_term(const CalibrationView& view, const ViewMotion& motion, Rng* signs) const {
  const Camera& camera = data_.cameras[static_cast<std::size_t>(view.camera)];
  const double weight = 1 / (setup_.corner_sigma_px * setup_.image_factor * view.noise_factor);
  ViewTerm term;
  for (const WeightedCorner& corner : view.corners) {
    if (!corner.used) continue;
    const std::optional<Vec3> p_C = corner_in_camera(view, corner, motion);
    if (!p_C) {
      term.cost += kUnseenCost;
      continue;
    }
    Mat2 D;
    const Vec2 n = p_C->head<2>() / p_C->z();
    Vec2 r = weight * (camera.distort(n, &D) - corner.pixel);
    const RobustValue robust = huber(r.squaredNorm(), setup_.corner_huber);
    term.cost += robust.cost;
    term.chi2 += r.squaredNorm();
    term.rows += 2;
    if (signs) r = {signs->below(2) ? 1 : -1, signs->below(2) ? 1 : -1};
    Eigen::Matrix<double, 2, 3> J_point;
    J_point << D, -D * n;
    J_point *= weight / p_C->z();
    Eigen::Matrix<double, 2, 7> J;  // (C4)
    J.leftCols<3>() = -J_point;
    J.middleCols<3>(3) = J_point * hat(*p_C);
    J.col(6) = corner.row * J.leftCols<6>() * motion.rate;
    term.H += robust.weight * J.transpose() * J;
    term.b += robust.weight * J.transpose() * r;
  }
  return term;
}

ImuCameraProblem::ViewTerm ImuCameraProblem::with_jitter(ViewTerm term, const CalibrationView& view,
                                                         const ViewMotion& motion) const {
  if (setup_.stamp_jitter_s <= 0) return term;
  // Images with one stamp are late together: each is worth its part.
  const double information = 1 / (setup_.stamp_jitter_s * setup_.stamp_jitter_s * view.sharing);
  const Eigen::Matrix<double, 7, 1> Hx = term.H.leftCols<6>() * motion.rate;
  const double along = motion.rate.dot(term.b.head<6>()), sum = motion.rate.dot(Hx.head<6>()) + information;
  term.H -= Hx * Hx.transpose() / sum;
  term.b -= along / sum * Hx;
  term.cost -= 0.5 * along * along / sum;
  term.chi2 -= along * along / sum;
  return term;
}

void ImuCameraProblem::view_columns(const CalibrationView& view, const ViewMotion& motion, const SplineJacobian& J) {
  const Pose<B, Cn>& T_BC = state_.T_BC[static_cast<std::size_t>(view.camera)];
  const Mat3 R_CB = T_BC.R().transpose(), R_CT = motion.T_CT.R();
  const Mat3 lever = -R_CB * hat(T_BC.p);
  begin_local(7, J.first);
  for (int k = 0; k < kSplineOrder; ++k) {  // (C5)
    const auto i = static_cast<std::size_t>(k);
    J_.block<3, 3>(0, 6 * k) = lever * J.J_theta_delta[i];
    J_.block<3, 3>(3, 6 * k) = R_CB * J.J_theta_delta[i];
    J_.block<3, 3>(0, 6 * k + 3) = J.p[i] * R_CT;
  }
  const int camera = columns(layout_.cameras[static_cast<std::size_t>(view.camera)], 6);
  J_.block<3, 3>(0, camera) = R_CB;
  J_.block<3, 3>(3, camera + 3).setIdentity();
  J_.block<6, 1>(0, columns(layout_.time_offset, 1)) = motion.rate;
  if (layout_.line_delay >= 0) J_(6, columns(layout_.line_delay, 1)) = 1;
  if (layout_.later >= 0 && view.camera > 0) J_.block<6, 1>(0, columns(layout_.later + view.camera - 1, 1)) = motion.rate;
}

double ImuCameraProblem::add_view(const CalibrationView& view, bool build) {
  SplineJacobian J;
  const ViewMotion motion = view_motion(view, build ? &J : nullptr);
  const ViewTerm term = with_jitter(view_term(view, motion, nullptr), view, motion);
  if (build) {
    view_columns(view, motion, J);
    const auto A = J_.leftCols(static_cast<Eigen::Index>(index_.size()));
    system_->add(index_, A.transpose() * term.H * A, A.transpose() * term.b);
  }
  return term.cost;
}

Vec6 ImuCameraProblem::reading_error(const CalibrationReading& reading) const {
  const SplineMotion m = state_.path.at(reading.t_s);
  const ImuBias bias = state_.bias_at(reading.t_s);
  const Vec3 f_B = m.T_TB.q.conjugate() * (state_.board_scale * m.a_TB - state_.gravity_T);
  Vec6 r;  // (C6)
  r << (state_.axes.gyro * m.w_TB_B + bias.gyro_radps - reading.gyro_radps) / setup_.gyro_sigma_radps,
      (state_.axes.accel * f_B + bias.accel_mps2 - reading.accel_mps2) / setup_.accel_sigma_mps2;
  return r;
}

void ImuCameraProblem::reading_columns(const CalibrationReading& reading) {
  SplineJacobian J;
  const SplineMotion m = state_.path.at(reading.t_s, &J);
  const Mat3 R_BT = m.T_TB.R().transpose();
  const Vec3 a_B = R_BT * m.a_TB, f_B = state_.board_scale * a_B - R_BT * state_.gravity_T;
  const double wg = 1 / setup_.gyro_sigma_radps, wa = 1 / setup_.accel_sigma_mps2;
  const Mat3 gyro = wg * state_.axes.gyro, accel = wa * state_.axes.accel, tilted = accel * hat(f_B), into_B = accel * R_BT;
  begin_local(6, J.first);
  for (int k = 0; k < kSplineOrder; ++k) {  // (C7)
    const auto i = static_cast<std::size_t>(k);
    J_.block<3, 3>(0, 6 * k) = gyro * J.J_rate_delta[i];
    J_.block<3, 3>(3, 6 * k) = tilted * J.J_theta_delta[i];
    J_.block<3, 3>(3, 6 * k + 3) = state_.board_scale * J.a[i] * into_B;
  }
  const int node = J.first / state_.intervals_per_bias;
  const double part = (reading.t_s / state_.path.spacing_s() - node * state_.intervals_per_bias) / state_.intervals_per_bias;
  for (int side = 0; side < 2; ++side) {
    const int bias = columns(bias_index_[static_cast<std::size_t>(node + side)], 6);
    const double share = side ? part : 1 - part;
    J_.block<3, 3>(0, bias).diagonal().setConstant(share * wg);
    J_.block<3, 3>(3, bias + 3).diagonal().setConstant(share * wa);
  }
  J_.block<3, 3>(3, columns(layout_.gravity, 3)) = -into_B;
  if (layout_.board_scale >= 0) J_.block<3, 1>(3, columns(layout_.board_scale, 1)) = accel * a_B;
  if (layout_.axes < 0) return;
  const int axes = columns(layout_.axes, 15);
  for (int row = 0; row < 3; ++row) J_.block<1, 3>(row, axes + 3 * row) = wg * m.w_TB_B.transpose();
  for (int row = 0, column = axes + 9; row < 3; ++row)
    for (int i = 0; i <= row; ++i) J_(3 + row, column++) = wa * f_B(i);
}

double ImuCameraProblem::add_reading(const CalibrationReading& reading, bool build) {
  const Vec6 r = reading_error(reading);
  const RobustValue gyro = huber(r.head<3>().squaredNorm(), setup_.reading_huber);
  const RobustValue accel = huber(r.tail<3>().squaredNorm(), setup_.reading_huber);
  if (build) {
    reading_columns(reading);
    r_ = r;
    J_.topRows<3>() *= std::sqrt(gyro.weight), r_.head<3>() *= std::sqrt(gyro.weight);
    J_.bottomRows<3>() *= std::sqrt(accel.weight), r_.tail<3>() *= std::sqrt(accel.weight);
    add_rows(true);
  }
  return gyro.cost + accel.cost;
}

void ImuCameraProblem::add_image_sum(const ViewTerm& image, ResidualSum& sum) const {
  const Mat6 H = image.H.topLeftCorner<6, 6>();
  const Eigen::LDLT<Mat6> factor(H);
  if (image.rows < 16 || factor.vectorD().minCoeff() <= 1e-9 * factor.vectorD().maxCoeff()) return;
  const Vec6 b = image.b.head<6>();
  sum.chi2 += b.dot(factor.solve(b)), sum.rows += 6;
}

ResidualSums ImuCameraProblem::residual_sums() {
  ResidualSums sums;
  double jitter_chi2 = 0, jitter_rows = 0, jitter_sure = 0;
  ViewTerm image;  // rows of one image lie side by side
  Rng signs(20261124);
  const auto random_sign = [&] { return signs.below(2) ? 1.0 : -1.0; };
  std::vector<Eigen::VectorXd> probes(3, Eigen::VectorXd::Zero(system_->size()));
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    const CalibrationView& view = data_.views[v];
    SplineJacobian J;
    const ViewMotion motion = view_motion(view, &J);
    const ViewTerm exact = view_term(view, motion, nullptr), late = with_jitter(exact, view, motion);
    const ViewTerm term = with_jitter(view_term(view, motion, &signs), view, motion);
    sums.corners.chi2 += late.chi2, sums.corners.rows += late.rows;
    image.H += late.H, image.b += late.b, image.rows += late.rows;
    const Vec6 Hx = exact.H.topLeftCorner<6, 6>() * motion.rate;
    if (const double sure = motion.rate.dot(Hx); sure > 0) {
      jitter_chi2 += std::pow(motion.rate.dot(exact.b.head<6>()), 2) / sure, jitter_rows += 1, jitter_sure += sure;
    }
    if (v + 1 == data_.views.size() || data_.views[v + 1].camera != view.camera || data_.views[v + 1].t_s != view.t_s) {
      add_image_sum(image, sums.images);
      image = {};
    }
    view_columns(view, motion, J);
    probes[0](index_) += J_.leftCols(static_cast<Eigen::Index>(index_.size())).transpose() * term.b;
  }
  for (const CalibrationReading& reading : data_.readings) {
    if (!reading.used) continue;
    const Vec6 r = reading_error(reading);
    sums.gyro.chi2 += r.head<3>().squaredNorm(), sums.gyro.rows += 3;
    sums.accel.chi2 += r.tail<3>().squaredNorm(), sums.accel.rows += 3;
    reading_columns(reading);
    Vec6 w;
    for (double& x : w) x = random_sign();
    const auto J = J_.leftCols(static_cast<Eigen::Index>(index_.size()));
    probes[1](index_) += J.topRows<3>().transpose() * w.head<3>();
    probes[2](index_) += J.bottomRows<3>().transpose() * w.tail<3>();
  }
  ResidualSum* all[3] = {&sums.corners, &sums.gyro, &sums.accel};
  for (int i = 0; i < 3; ++i)
    all[i]->taken_up = probes[static_cast<std::size_t>(i)].dot(system_->solve(probes[static_cast<std::size_t>(i)]));
  // (C12)
  if (jitter_chi2 > kJitters * jitter_rows) sums.stamp_jitter_s = std::sqrt((jitter_chi2 - jitter_rows) / jitter_sure);
  sums.images.taken_up = sums.corners.taken_up;
  return sums;
}

}  // namespace fbvins
