// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/rig_adjustment.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "fbvins/calibration/lens_jacobian.hpp"

namespace fbvins {
namespace {

constexpr int kMostLocal = 6 + kMostLensParameters + 6;  ///< pose, lens, extrinsics
using LocalMatrix = Eigen::Matrix<double, kMostLocal, kMostLocal>;
using LocalVector = Eigen::Matrix<double, kMostLocal, 1>;
/// What a corner counts that the lens cannot see at all, in units of the loss at this distance.
constexpr double kUnseen_px = 100;

double loss(double size_px, double spread_px) {
  return spread_px > 0 && size_px > spread_px ? spread_px * (size_px - 0.5 * spread_px) : 0.5 * size_px * size_px;
}

}  // namespace

/// H = [A C^T; C G] with A of the pose and the rest of the cameras that see the board.
struct RigAdjustment::FrameEquations {
  Mat6 A = Mat6::Zero();
  Vec6 a = Vec6::Zero();
  std::vector<int> columns;  ///< the global parameter of each row of C
  Eigen::MatrixXd C, G;
  Eigen::VectorXd g;
};

RigAdjustment::RigAdjustment(std::vector<RigCamera> cameras, std::vector<RigFrame> frames)
    : cameras_(std::move(cameras)), frames_(std::move(frames)) {
  for (std::size_t k = 0; k < cameras_.size(); ++k) {
    first_.push_back(size_);
    size_ += lens_parameter_count(cameras_[k].lens) + (k > 0 ? 6 : 0);
  }
}

Vec2 RigAdjustment::residual(const RigFrame& frame, const SeenBoard& view, const SeenCorner& corner) const {
  const RigCamera& camera = cameras_[view.camera];
  const auto pixel = project_point(camera.lens, camera.T_CnC0 * (frame.T_C0T * corner.p_T));
  return pixel ? Vec2(corner.pixel - *pixel) : Vec2::Constant(std::numeric_limits<double>::infinity());
}

double RigAdjustment::cost(const RigFrame& frame, double spread_px) const {
  double sum = 0;
  for (const SeenBoard& view : frame.views) {
    const RigCamera& camera = cameras_[view.camera];
    const Pose<Cn, T> T_CnT = camera.T_CnC0 * frame.T_C0T;
    for (const SeenCorner& corner : view.corners) {
      if (!corner.kept) continue;
      const auto pixel = project_point(camera.lens, T_CnT * corner.p_T);
      sum += loss(pixel ? (*pixel - corner.pixel).norm() : kUnseen_px, spread_px);
    }
  }
  return sum;
}

RigAdjustment::FrameEquations RigAdjustment::linearise(const RigFrame& frame, double spread_px) const {
  FrameEquations out;
  for (const SeenBoard& view : frame.views) {
    const int count = lens_parameter_count(cameras_[view.camera].lens) + (view.camera > 0 ? 6 : 0);
    for (int k = 0; k < count; ++k) out.columns.push_back(first_[view.camera] + k);
  }
  const int size = static_cast<int>(out.columns.size());
  out.C = Eigen::MatrixXd::Zero(size, 6);
  out.G = Eigen::MatrixXd::Zero(size, size);
  out.g = Eigen::VectorXd::Zero(size);
  int row = 0;
  for (const SeenBoard& view : frame.views) {
    const RigCamera& camera = cameras_[view.camera];
    const int lens = lens_parameter_count(camera.lens), extrinsic = view.camera > 0 ? 6 : 0;
    const Mat3 R_CnC0 = camera.T_CnC0.R(), R_CnT = R_CnC0 * frame.T_C0T.R();
    LocalMatrix H = LocalMatrix::Zero();
    LocalVector b = LocalVector::Zero();
    for (const SeenCorner& corner : view.corners) {
      if (!corner.kept) continue;
      const Vec3 p_C0 = frame.T_C0T * corner.p_T;
      LensDerivatives d;
      const auto pixel = project_point(camera.lens, camera.T_CnC0 * p_C0, &d);
      if (!pixel) continue;
      const Vec2 r = *pixel - corner.pixel;
      const double distance = r.norm(), weight = spread_px > 0 && distance > spread_px ? spread_px / distance : 1;
      Eigen::Matrix<double, 2, kMostLocal> J;
      J.leftCols<3>() = d.point * R_CnC0;
      J.middleCols<3>(3) = -d.point * (R_CnT * hat(corner.p_T));
      J.middleCols<kMostLensParameters>(6) = d.parameters;
      J.middleCols<3>(6 + lens) = d.point;  // over columns of parameters that this lens does not have
      J.middleCols<3>(9 + lens) = -d.point * (R_CnC0 * hat(p_C0));
      const int used = 6 + lens + extrinsic;
      H.topLeftCorner(used, used).noalias() += weight * J.leftCols(used).transpose() * J.leftCols(used);
      b.head(used).noalias() -= weight * J.leftCols(used).transpose() * r;
    }
    const int own = lens + extrinsic;
    out.A += H.topLeftCorner<6, 6>();
    out.a += b.head<6>();
    out.C.middleRows(row, own) = H.block(6, 0, own, 6);
    out.G.block(row, row, own, own) = H.block(6, 6, own, own);
    out.g.segment(row, own) = b.segment(6, own);
    row += own;
  }
  return out;
}

RigAdjustment::Evidence RigAdjustment::evidence(const RigFrame& frame) const {
  const FrameEquations f = linearise(frame, 0);
  const PoseFactor factor = f.A.ldlt();
  const Eigen::MatrixXd reduced = f.G - f.C * factor.solve(f.C.transpose());
  const Eigen::VectorXd right = f.g - f.C * factor.solve(f.a);
  Evidence out{Eigen::MatrixXd::Zero(size_, size_), Eigen::VectorXd::Zero(size_)};
  for (std::size_t i = 0; i < f.columns.size(); ++i) {
    out.gradient[f.columns[i]] += right[i];
    for (std::size_t j = 0; j < f.columns.size(); ++j) out.information(f.columns[i], f.columns[j]) += reduced(i, j);
  }
  return out;
}

std::vector<RigAdjustment::Evidence> RigAdjustment::evidence() const {
  std::vector<Evidence> out;
  for (const RigFrame& frame : frames_) out.push_back(evidence(frame));
  return out;
}

namespace {

std::vector<RigCamera> moved(const std::vector<RigCamera>& cameras, const std::vector<int>& first, const Eigen::VectorXd& step) {
  std::vector<RigCamera> out = cameras;
  for (std::size_t k = 0; k < out.size(); ++k) {
    const int count = lens_parameter_count(out[k].lens);
    out[k].lens = moved_lens(out[k].lens, step.data() + first[k]);
    if (k > 0) out[k].T_CnC0 = out[k].T_CnC0.boxplus(step.segment<3>(first[k] + count), step.segment<3>(first[k] + count + 3));
  }
  return out;
}

/// x of (S + lambda diag S) x = s, scaled to a unit diagonal first: pixels and metres differ by orders of magnitude.
Eigen::VectorXd solve_damped(const Eigen::MatrixXd& S, const Eigen::VectorXd& s, double lambda) {
  const Eigen::VectorXd scale = S.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * S * scale.asDiagonal();
  scaled.diagonal().array() += lambda;
  return scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(s)));
}

}  // namespace

/// The damped step of all cameras' parameters, with the factor of each frame's pose.
Eigen::VectorXd RigAdjustment::camera_step(const std::vector<FrameEquations>& equations, double lambda, bool poses_only,
                                           std::vector<PoseFactor>& factors) const {
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(size_, size_);
  Eigen::VectorXd s = Eigen::VectorXd::Zero(size_);
  factors.clear();
  for (const FrameEquations& f : equations) {
    Mat6 damped = f.A;
    damped.diagonal() *= 1 + lambda;
    damped.diagonal().array() += 1e-12;
    factors.emplace_back(damped);
    if (poses_only) continue;
    const Eigen::MatrixXd solved = factors.back().solve(f.C.transpose());
    const Eigen::MatrixXd reduced = f.G - f.C * solved;
    const Eigen::VectorXd right = f.g - solved.transpose() * f.a;
    for (std::size_t i = 0; i < f.columns.size(); ++i) {
      s[f.columns[i]] += right[i];
      for (std::size_t j = 0; j < f.columns.size(); ++j) S(f.columns[i], f.columns[j]) += reduced(i, j);
    }
  }
  return poses_only ? Eigen::VectorXd(Eigen::VectorXd::Zero(size_)) : solve_damped(S, s, lambda);
}

void RigAdjustment::move_poses(const std::vector<FrameEquations>& equations, const std::vector<PoseFactor>& factors,
                               const Eigen::VectorXd& step) {
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    Eigen::VectorXd own(equations[f].columns.size());
    for (Eigen::Index i = 0; i < own.size(); ++i) own[i] = step[equations[f].columns[i]];
    const Vec6 d = factors[f].solve(equations[f].a - equations[f].C.transpose() * own);
    frames_[f].T_C0T = frames_[f].T_C0T.boxplus(d.head<3>(), d.tail<3>());
  }
}

double RigAdjustment::total_cost(double spread_px) const {
  double sum = 0;
  for (const RigFrame& frame : frames_) sum += cost(frame, spread_px);
  return sum;
}

AdjustmentSummary RigAdjustment::solve(const AdjustmentOptions& options) {
  AdjustmentSummary summary;
  summary.cost = total_cost(options.spread_px);
  double lambda = 1e-4;
  std::vector<PoseFactor> factors;
  for (; summary.iterations < options.max_iterations; ++summary.iterations) {
    std::vector<FrameEquations> equations;
    for (const RigFrame& frame : frames_) equations.push_back(linearise(frame, options.spread_px));
    bool better = false;
    double decrease = 0;
    for (int retry = 0; retry < 8 && !better; ++retry) {
      const Eigen::VectorXd step = camera_step(equations, lambda, options.poses_only, factors);
      const std::vector<RigCamera> cameras = cameras_;
      std::vector<Pose<C0, T>> poses;
      for (const RigFrame& frame : frames_) poses.push_back(frame.T_C0T);
      if (step.allFinite()) {
        cameras_ = moved(cameras_, first_, step);
        move_poses(equations, factors, step);
      }
      const double next = total_cost(options.spread_px);
      if ((better = next < summary.cost)) {
        decrease = summary.cost - next;
        summary.cost = next;
        lambda = std::max(0.1 * lambda, 1e-12);
      } else {
        cameras_ = cameras;
        for (std::size_t f = 0; f < frames_.size(); ++f) frames_[f].T_C0T = poses[f];
        lambda = std::max(10 * lambda, 1e-8);
      }
    }
    if (!better || decrease < 1e-9 * summary.cost) break;
  }
  summary.usable = std::isfinite(summary.cost);
  return summary;
}

}  // namespace fbvins
