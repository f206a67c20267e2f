// SPDX-License-Identifier: Apache-2.0
// Residuals of keyframe poses for automatic differentiation, shared by the pose graph and the final adjustment
// (docs/derivations/loop.md, L8-L10, L22). A node is x = (p, yaw about M's z) or (p, dtheta in B), about a starting orientation.
#pragma once

#include <ceres/cost_function.h>
#include <ceres/solver.h>

#include <cmath>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/loop/partial_pose.hpp"

namespace fbvins {

/// One thread, and iterations as the only budget: the same problem gives the same bits.
inline ceres::Solver::Options repeatable_solver(ceres::LinearSolverType type, int max_iterations) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = type;
  // A Ceres without SuiteSparse, as in Python's wheels, has Eigen's: other roundings, the same solutions.
  solver.sparse_linear_algebra_library_type =
      ceres::IsSparseLinearAlgebraLibraryTypeAvailable(ceres::SUITE_SPARSE) ? ceres::SUITE_SPARSE : ceres::EIGEN_SPARSE;
  solver.num_threads = 1;
  solver.max_num_iterations = max_iterations;
  solver.function_tolerance = 1e-5;
  solver.max_solver_time_in_seconds = 1e9;  // never limited by time
  solver.logging_type = ceres::SILENT;
  return solver;
}

/// Orientation of a node from its parameters: (p, yaw about M's z) or (p, dtheta in B).
template <int Dof, class T>
Eigen::Quaternion<T> orientation(const Quat& start, const T* x) {
  const Eigen::Quaternion<T> q = start.cast<T>();
  if constexpr (Dof == 4) {
    const T half = x[3] * 0.5;
    using std::cos, std::sin;
    return Eigen::Quaternion<T>(cos(half), T(0), T(0), sin(half)) * q;
  } else {
    // Small steps about `start`, which is the pose of the solve before: 2 atan(|v|/2) differs from |v| in third order.
    const Eigen::Quaternion<T> d(T(1), x[3] * 0.5, x[4] * 0.5, x[5] * 0.5);
    return (q * d).normalized();
  }
}

/// d(right perturbation of the orientation) / d(x[3..5]) for six degrees of freedom: of the rotation (1, x/2), normalised.
inline Mat3 turn_jacobian(const double* x) {
  const Vec3 half(0.5 * x[3], 0.5 * x[4], 0.5 * x[5]);
  return (Mat3::Identity() - hat(half)) / (1 + half.squaredNorm());
}

template <int Dof>
struct EdgeCost {
  Quat q_a, q_b;
  Pose<B, B> T_ab;
  Mat6 root;  // of the weighted information

  template <class T>
  bool operator()(const T* a, const T* b, T* out) const {
    const Eigen::Quaternion<T> Ra = orientation<Dof>(q_a, a), Rb = orientation<Dof>(q_b, b);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> pa(a), pb(b);
    Eigen::Matrix<T, 6, 1> r;
    r.template head<3>() = Ra.conjugate() * Eigen::Matrix<T, 3, 1>(pb - pa) - T_ab.p.cast<T>();
    const Eigen::Quaternion<T> e = T_ab.q.conjugate().cast<T>() * (Ra.conjugate() * Rb);
    r.template tail<3>() = e.vec() * (e.w() < T(0) ? T(-2) : T(2));
    Eigen::Map<Eigen::Matrix<T, 6, 1>>(out, 6) = root.cast<T>() * r;
    return true;
  }
};

/// An edge in units of which the logarithm in M is `share` s, s being that of a flight's, or the sum of two. What is compared is
/// in these units: in M's a smaller map would fit better.
template <int Dof>
struct ScaledEdgeCost {
  EdgeCost<Dof> edge;
  double share;

  template <class T>
  bool operator()(const T* a, const T* b, const T* s, T* out) const {
    return evaluate(a, b, s[0], out);
  }
  template <class T>
  bool operator()(const T* a, const T* b, const T* s, const T* s_too, T* out) const {
    return evaluate(a, b, T(s[0] + s_too[0]), out);
  }

  template <class T>
  bool evaluate(const T* a, const T* b, const T& log_scale, T* out) const {
    using std::exp;
    const T units = exp(log_scale * T(-share));
    T from[Dof], to[Dof];
    for (int i = 0; i < Dof; ++i) from[i] = i < 3 ? T(0) : a[i], to[i] = i < 3 ? T(units * (b[i] - a[i])) : b[i];
    return edge(from, to, out);
  }
};

/// What a flight says of its scale by itself.
struct ScaleCost {
  double per_sigma;

  template <class T>
  bool operator()(const T* log_scale, T* out) const {
    out[0] = log_scale[0] * per_sigma;
    return true;
  }
};

/// A measurement of a node by itself.
template <int Dof>
struct AnchorCost {
  Quat q;
  PartialPose measured;
  Mat6 root;  // of the weighted information

  template <class T>
  bool operator()(const T* a, T* out) const {
    using V3 = Eigen::Matrix<T, 3, 1>;
    const Eigen::Quaternion<T> R = orientation<Dof>(q, a);
    Eigen::Matrix<T, 6, 1> r;
    r.template head<3>() = R * V3(measured.p_B.cast<T>()) + Eigen::Map<const V3>(a) - V3(measured.T_AB.p.template cast<T>());
    const Eigen::Quaternion<T> e = measured.T_AB.q.conjugate().cast<T>() * R;
    r.template tail<3>() = e.vec() * (e.w() < T(0) ? T(-2) : T(2));
    Eigen::Map<Eigen::Matrix<T, 6, 1>>(out, 6) = root.cast<T>() * r;
    return true;
  }
};

/// The vertical of a node with six degrees of freedom against up in M, which is z turned by (a, b, 0).
struct GravityCost {
  Quat q;
  Vec3 up_B;
  double per_sigma;

  template <class T>
  bool operator()(const T* a, const T* tilt, T* out) const {
    using V3 = Eigen::Matrix<T, 3, 1>;
    const V3 up = orientation<6>(q, a) * up_B.cast<T>();
    const Eigen::Quaternion<T> level(T(1), tilt[0] * T(-0.5), tilt[1] * T(-0.5), T(0));
    const V3 off = level.normalized() * up;
    out[0] = off.x() * per_sigma;
    out[1] = off.y() * per_sigma;
    return true;
  }
};

/// With automatic derivatives, compiled once; of four and of six degrees of freedom. The caller owns it. Blocks: nodes, then
/// scales.
template <int Dof>
ceres::CostFunction* cost_function(const EdgeCost<Dof>& cost);
/// `scales`: one or two.
template <int Dof>
ceres::CostFunction* cost_function(const ScaledEdgeCost<Dof>& cost, int scales);
template <int Dof>
ceres::CostFunction* cost_function(const AnchorCost<Dof>& cost);
ceres::CostFunction* cost_function(const ScaleCost& cost);
/// Blocks: node, tilt.
ceres::CostFunction* cost_function(const GravityCost& cost);

}  // namespace fbvins
