// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/alignment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "fbvins/geometry/symmetric.hpp"
#include "fbvins/imu/alignment_rotation.hpp"
#include "fbvins/imu/static_initialiser.hpp"
#include "fbvins/optim/dense_system.hpp"

namespace fbvins {
namespace {

using Poses = std::vector<Pose<VisualWorld, B>>;
using Intervals = std::vector<Preintegration>;
using Vec6Rows = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 18>;

constexpr int kGravityIterations = 4;

/// Gravity in V as base + T * y: three free numbers, or two on the tangent plane (eq. A14).
struct GravityParametrisation {
  Vec3 base = Vec3::Zero();
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> T = Mat3::Identity();
};

/// Unknowns: corrections of the n positions, n velocities in V, gravity, accelerometer bias.
struct LinearSolution {
  bool solved = false;
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
  double cost = 0;
  int gravity = 0, accel_bias = 0;  ///< where these unknowns begin
};

class LinearProblem {
 public:
  LinearProblem(int frames, const GravityParametrisation& gravity)
      : n_(frames), gravity_(gravity), H_(Eigen::MatrixXd::Zero(size(), size())), b_(Eigen::VectorXd::Zero(size())) {}

  int position(int k) const { return 3 * k; }
  int velocity(int k) const { return 3 * (n_ + k); }
  int gravity() const { return 6 * n_; }
  int gravity_size() const { return static_cast<int>(gravity_.T.cols()); }
  int accel_bias() const { return gravity() + gravity_size(); }
  int size() const { return accel_bias() + 3; }

  void add_prior(int at, double sigma, const Vec3& mean = Vec3::Zero()) {
    const double information = 1 / (sigma * sigma);
    H_.diagonal().segment<3>(at).array() += information;
    b_.segment<3>(at) += information * mean;
    constant_ += information * mean.squaredNorm();
  }

  /// Two vector equations of an interval, whitened (eq. A11-A13). R_VB: orientation at its beginning.
  void add_interval(int k, const Poses& poses, const Quat& R_VB, double sigma_rad, const Preintegration& between) {
    const double dt = between.dt_s();
    const Mat3 Rt = R_VB.toRotationMatrix().transpose();
    const Mat3 J_p = between.J_p_ba(), J_v = between.J_v_ba();
    const Vec3 a = -between.linearisation_bias().accel_mps2;  // deltas refer to this bias, x to zero bias
    const int m = gravity_size();
    Vec6Rows A = Vec6Rows::Zero(6, 15 + m);
    A.block<3, 3>(0, 0) = -Rt;
    A.block<3, 3>(0, 3) = Rt;
    A.block<3, 3>(0, 6) = -dt * Rt;
    A.block<3, 3>(3, 6) = -Rt;
    A.block<3, 3>(3, 9) = Rt;
    A.block(0, 12, 3, m) = -0.5 * dt * dt * Rt * gravity_.T;
    A.block(3, 12, 3, m) = -dt * Rt * gravity_.T;
    A.block<3, 3>(0, 12 + m) = -J_p;
    A.block<3, 3>(3, 12 + m) = -J_v;
    Vec6 r;  // residual at x = 0
    r << Rt * (poses[k + 1].p - poses[k].p - 0.5 * dt * dt * gravity_.base) - (between.delta_p() + J_p * a),
        -dt * Rt * gravity_.base - (between.delta_v() + J_v * a);
    whiten(between, sigma_rad, A, r);
    const int at[6] = {position(k), position(k + 1), velocity(k), velocity(k + 1), gravity(), accel_bias()};
    const int from[6] = {0, 3, 6, 9, 12, 12 + m};
    for (int i = 0; i < 6; ++i) {
      const int rows = i == 4 ? m : 3;
      b_.segment(at[i], rows) -= A.middleCols(from[i], rows).transpose() * r;
      for (int j = 0; j < 6; ++j) {
        const int cols = j == 4 ? m : 3;
        H_.block(at[i], at[j], rows, cols) += A.middleCols(from[i], rows).transpose() * A.middleCols(from[j], cols);
      }
    }
    constant_ += r.squaredNorm();
  }

  LinearSolution solve() const {
    LinearSolution s;
    auto solution = solve_and_invert_symmetric(H_, b_);
    if (!solution) return s;
    s.x = std::move(solution->x);
    s.covariance = std::move(solution->inverse);
    s.cost = std::max(0.0, constant_ - b_.dot(s.x));
    s.gravity = gravity();
    s.accel_bias = accel_bias();
    s.solved = true;
    return s;
  }

 private:
  /// Multiplies by the inverse Cholesky factor of the covariance of (p, v): of the readings and of the
  /// orientation that rotates the deltas (eq. A12).
  static void whiten(const Preintegration& between, double sigma_rad, Vec6Rows& A, Vec6& r) {
    const Mat15& P = between.covariance();
    Mat6 S;
    S << P.block<3, 3>(nav::p, nav::p), P.block<3, 3>(nav::p, nav::v), P.block<3, 3>(nav::v, nav::p),
        P.block<3, 3>(nav::v, nav::v);
    Eigen::Matrix<double, 6, 3> turned;
    turned << hat(between.delta_p()), hat(between.delta_v());
    S += sigma_rad * sigma_rad * turned * turned.transpose();
    const Eigen::LLT<Mat6> llt(S);
    llt.matrixL().solveInPlace(A);
    llt.matrixL().solveInPlace(r);
  }

  int n_;
  GravityParametrisation gravity_;
  Eigen::MatrixXd H_;
  Eigen::VectorXd b_;
  double constant_ = 0;
};

LinearSolution solve_linear(const Poses& poses, const RotationAlignment& rotation, const Intervals& between,
                            const GravityParametrisation& gravity, const AlignmentOptions& o) {
  const int n = static_cast<int>(poses.size());
  LinearProblem problem(n, gravity);
  for (int k = 0; k < n; ++k) problem.add_prior(problem.position(k), o.pose_sigma_m);
  problem.add_prior(problem.accel_bias(), o.accel_bias_prior_mps2, o.accel_bias_mps2);
  for (int k = 0; k + 1 < n; ++k) problem.add_interval(k, poses, rotation.R_VB[k], rotation.sigma_rad[k], between[k]);
  return problem.solve();
}

/// Gravity of given norm near `direction` (eq. A14).
GravityParametrisation on_sphere(const Vec3& direction, double gravity_mps2) {
  const Vec3 d = direction.normalized();
  const Vec3 u = d.unitOrthogonal();
  GravityParametrisation g;
  g.base = gravity_mps2 * d;
  g.T.resize(3, 2);
  g.T << gravity_mps2 * u, gravity_mps2 * d.cross(u);
  return g;
}

AlignmentRefusal check_input(const Poses& poses, const Intervals& between, const AlignmentOptions& o) {
  if (static_cast<int>(poses.size()) < std::max(3, o.min_frames)) return AlignmentRefusal::too_few_frames;
  if (between.size() + 1 != poses.size()) return AlignmentRefusal::bad_input;
  for (const auto& T : poses)
    if (!T.p.allFinite() || !T.q.coeffs().allFinite()) return AlignmentRefusal::bad_input;
  double duration_s = 0;
  for (const Preintegration& p : between) {
    if (p.empty() || !p.delta_p().allFinite() || !p.delta_q().coeffs().allFinite()) return AlignmentRefusal::bad_input;
    if (p.longest_gap_s() > o.max_gap_s) return AlignmentRefusal::imu_gap;
    duration_s += p.dt_s();
  }
  return duration_s < o.min_duration_s ? AlignmentRefusal::too_short : AlignmentRefusal::none;
}

AlignmentRefusal judge_rotation(const RotationAlignment& r, const AlignmentOptions& o) {
  if (!r.solved) return AlignmentRefusal::solver_failed;
  if (!(r.rms <= o.max_residual_rms)) return AlignmentRefusal::rotation_inconsistent;
  if (!(r.gyro_bias_sigma_radps * std::max(1.0, r.rms) <= o.max_gyro_bias_sigma_radps))
    return AlignmentRefusal::gyro_bias_unobservable;
  if (!(r.gyro_bias_radps.norm() <= o.max_gyro_bias_radps)) return AlignmentRefusal::gyro_bias_implausible;
  return AlignmentRefusal::none;
}

AlignmentRefusal judge_motion(const AlignmentResult& a, const AlignmentOptions& o, double gravity_mps2) {
  if (!(std::abs(a.gravity_norm_mps2 - gravity_mps2) <= o.max_gravity_error_mps2)) return AlignmentRefusal::gravity_magnitude;
  if (!(a.motion_rms <= o.max_residual_rms)) return AlignmentRefusal::motion_inconsistent;
  if (!(a.gravity_sigma_rad <= o.max_gravity_sigma_rad)) return AlignmentRefusal::gravity_unobservable;
  if (!(a.bias.accel_mps2.norm() <= o.max_accel_bias_mps2)) return AlignmentRefusal::accel_bias_implausible;
  return AlignmentRefusal::none;
}

/// Magnitude and observability of gravity when nothing is assumed of it (eq. A17).
void describe_free_gravity(const LinearSolution& s, AlignmentResult& result) {
  result.gravity_norm_mps2 = s.x.segment<3>(s.gravity).norm();
  const Mat3 covariance = s.covariance.block<3, 3>(s.gravity, s.gravity);
  const Vec3 eigenvalues = Eigen::SelfAdjointEigenSolver<Mat3>(covariance, Eigen::EigenvaluesOnly).eigenvalues();
  result.gravity_information_min = 1 / eigenvalues.maxCoeff();
  result.gravity_condition = eigenvalues.maxCoeff() / eigenvalues.minCoeff();
}

/// Uncertainties, scaled up where the residuals are larger than assumed (eq. A18).
void describe_fit(const LinearSolution& s, int n, AlignmentResult& result) {
  const int freedom = std::max(1, 6 * (n - 1) + 3 * n + 3 - static_cast<int>(s.x.size()));
  result.motion_rms = std::sqrt(s.cost / freedom);
  const double scale = std::max(1.0, result.motion_rms);
  const Mat2 direction = s.covariance.block<2, 2>(s.gravity, s.gravity);
  result.gravity_sigma_rad = scale * std::sqrt(std::max(0.0, largest_eigenvalue(direction)));
  result.accel_bias_sigma_mps2 = scale * std::sqrt(s.covariance.diagonal().segment<3>(s.accel_bias).maxCoeff());
  result.velocity_sigma_mps = scale * std::sqrt(s.covariance.diagonal().segment<3>(s.gravity - 3).maxCoeff());
}

/// Transforms poses and velocities to G (eq. A19, A20).
void to_gauge(const Poses& poses, const LinearSolution& s, const Vec3& gravity_V, AlignmentResult& result) {
  const int n = static_cast<int>(poses.size());
  const Vec3 up_B0 = poses[0].q.conjugate() * Vec3(-gravity_V);
  result.R_GV = (level_rotation(up_B0) * poses[0].q.conjugate()).normalized();
  for (int k = 0; k < n; ++k) {
    NavState<G> state;
    state.T_FB.q = (result.R_GV * poses[k].q).normalized();
    state.T_FB.p = result.R_GV * Vec3(poses[k].p - poses[0].p);
    state.v_FB = result.R_GV * Vec3(s.x.segment<3>(3 * (n + k)));
    state.bias = result.bias;
    result.states.push_back(state);
  }
}

}  // namespace

AlignmentResult align_visual_inertial(const Poses& poses, Intervals& between, const AlignmentOptions& options,
                                      double gravity_mps2) {
  AlignmentResult result;
  const auto refuse = [&](AlignmentRefusal reason) {
    result.reason = reason;
    return result;
  };
  if (const auto reason = check_input(poses, between, options); reason != AlignmentRefusal::none) return refuse(reason);

  const RotationAlignment rotation = align_rotations(poses, between, options);
  result.bias.gyro_radps = rotation.gyro_bias_radps;
  result.gyro_bias_sigma_radps = rotation.gyro_bias_sigma_radps * std::max(1.0, rotation.rms);
  result.rotation_rms = rotation.rms;
  if (const auto reason = judge_rotation(rotation, options); reason != AlignmentRefusal::none) return refuse(reason);

  LinearSolution solution = solve_linear(poses, rotation, between, {}, options);
  if (!solution.solved) return refuse(AlignmentRefusal::solver_failed);
  describe_free_gravity(solution, result);
  Vec3 gravity_V = solution.x.segment<3>(solution.gravity);
  for (int iteration = 0; iteration < kGravityIterations; ++iteration) {
    const GravityParametrisation sphere = on_sphere(gravity_V, gravity_mps2);
    solution = solve_linear(poses, rotation, between, sphere, options);
    if (!solution.solved) return refuse(AlignmentRefusal::solver_failed);
    const Vec2 y = solution.x.segment<2>(solution.gravity);
    gravity_V = gravity_mps2 * (sphere.base + sphere.T * y).normalized();
    if (y.norm() < 1e-7) break;
  }
  result.bias.accel_mps2 = solution.x.segment<3>(solution.accel_bias);
  describe_fit(solution, static_cast<int>(poses.size()), result);
  if (const auto reason = judge_motion(result, options, gravity_mps2); reason != AlignmentRefusal::none) return refuse(reason);

  for (Preintegration& p : between) p.repropagate(result.bias);
  to_gauge(poses, solution, gravity_V, result);
  result.accepted = true;
  return result;
}

std::string_view to_string(AlignmentRefusal reason) {
  switch (reason) {
    case AlignmentRefusal::none: return "none";
    case AlignmentRefusal::too_few_frames: return "too_few_frames";
    case AlignmentRefusal::too_short: return "too_short";
    case AlignmentRefusal::bad_input: return "bad_input";
    case AlignmentRefusal::imu_gap: return "imu_gap";
    case AlignmentRefusal::solver_failed: return "solver_failed";
    case AlignmentRefusal::gyro_bias_unobservable: return "gyro_bias_unobservable";
    case AlignmentRefusal::gyro_bias_implausible: return "gyro_bias_implausible";
    case AlignmentRefusal::rotation_inconsistent: return "rotation_inconsistent";
    case AlignmentRefusal::gravity_magnitude: return "gravity_magnitude";
    case AlignmentRefusal::gravity_unobservable: return "gravity_unobservable";
    case AlignmentRefusal::accel_bias_implausible: return "accel_bias_implausible";
    case AlignmentRefusal::motion_inconsistent: return "motion_inconsistent";
  }
  return "?";
}

}  // namespace fbvins
