// SPDX-License-Identifier: Apache-2.0
// Two methods, one window: our analytic Jacobians, Schur elimination and Levenberg-Marquardt against
// Ceres with automatic derivatives of independently written residuals, and against a dense QR.
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "fbvins/estimator/window_problem.hpp"
#include "fbvins/estimator/window_test_scene.hpp"

namespace fbvins {
namespace {

using test::kFrames;
using test::kLandmarks;
using test::Window;

template <class T>
using Vec = Eigen::Matrix<T, 3, 1>;
template <class T>
using Q = Eigen::Quaternion<T>;

template <class T>
Q<T> exp(const T* theta) {
  T q[4];
  ceres::AngleAxisToQuaternion(theta, q);
  return {q[0], q[1], q[2], q[3]};
}

/// Everything about a frame that moves with its perturbation d of 15 numbers.
template <class T>
struct Moved {
  Vec<T> p, v, bg, ba;
  Q<T> q;
  Moved(const NavState& s, const T* d)
      : p(s.T_WB.p.cast<T>() + Eigen::Map<const Vec<T>>(d)),
        v(s.v_WB.cast<T>() + Eigen::Map<const Vec<T>>(d + 6)),
        bg(s.bias.gyro_radps.cast<T>() + Eigen::Map<const Vec<T>>(d + 9)),
        ba(s.bias.accel_mps2.cast<T>() + Eigen::Map<const Vec<T>>(d + 12)),
        q(s.T_WB.q.cast<T>() * exp(d + 3)) {}
};

/// The reprojection, from its definition: a point on a ray of the host's left camera at depth 1 / rho.
struct Reprojection {
  NavState host, target;
  Calibration calibration;
  WindowObservation o;
  bool same_frame;

  template <class T>
  bool project(const Vec<T>& p_W_or_B, const Q<T>& q, const Vec<T>& p, const T* c, T* r) const {
    const Vec<T> p_B = same_frame ? p_W_or_B : Vec<T>(q.conjugate() * Vec<T>(p_W_or_B - p));
    const Vec3 t_BC = o.right ? calibration.T_BC1.p : calibration.T_BC0.p;
    const Quat q_BC = o.right ? calibration.T_BC1.q : calibration.T_BC0.q;
    const T* d = c + (o.right ? 6 : 0);
    const Vec<T> t = t_BC.cast<T>() + Eigen::Map<const Vec<T>>(d);
    const Vec<T> p_C = (q_BC.cast<T>() * exp(d + 3)).conjugate() * Vec<T>(p_B - t);
    const T offset = T(calibration.time_offset_s) + c[12];
    const Eigen::Matrix<T, 2, 1> e = p_C.template head<2>() / p_C.z() - o.normalised.cast<T>() + offset * o.velocity.cast<T>();
    Eigen::Map<Eigen::Matrix<T, 2, 1>> out(r);
    out = o.sqrt_information.cast<T>() * e;
    return true;
  }
  template <class T>
  Vec<T> in_host_body(const T* l, const T* c) const {
    const Vec<T> p_C = Vec<T>(l[0], l[1], T(1)) / l[2];
    return (calibration.T_BC0.q.cast<T>() * exp(c + 3)) * p_C + calibration.T_BC0.p.cast<T>() + Eigen::Map<const Vec<T>>(c);
  }
  template <class T>
  bool operator()(const T* l, const T* c, T* r) const {
    return project<T>(in_host_body(l, c), Q<T>::Identity(), Vec<T>::Zero(), c, r);
  }
  template <class T>
  bool operator()(const T* d_host, const T* d_target, const T* l, const T* c, T* r) const {
    const Moved<T> h(host, d_host), t(target, d_target);
    return project<T>(h.q * in_host_body(l, c) + h.p, t.q, t.p, c, r);
  }
};

/// The landmark's distance from where it was (K1), from its definition.
struct Belief {
  Reprojection seen;
  LandmarkBelief belief;
  template <class T>
  bool operator()(const T* d_host, const T* l, const T* c, T* r) const {
    const Moved<T> h(seen.host, d_host);
    Eigen::Map<Vec<T>> out(r);
    out = belief.sqrt_information.cast<T>() * Vec<T>(h.q * seen.in_host_body(l, c) + h.p - belief.p_W.cast<T>());
    return true;
  }
};

struct Imu {
  NavState from, to;
  const Preintegration* between;
  double gravity;

  template <class T>
  bool operator()(const T* d_i, const T* d_j, const T* tilt, T* out) const {
    const Moved<T> i(from, d_i), j(to, d_j);
    const T dt(between->dt_s());
    const T turn[3] = {tilt[0], tilt[1], T(0)};
    const Vec<T> g = exp(turn) * Vec<T>(T(0), T(0), T(-gravity));
    const Vec<T> dbg = i.bg - between->linearisation_bias().gyro_radps.cast<T>();
    const Vec<T> dba = i.ba - between->linearisation_bias().accel_mps2.cast<T>();
    const Vec<T> theta = between->J_theta_bg().cast<T>() * dbg;
    const Q<T> dq = between->delta_q().cast<T>() * exp(theta.data());
    const Q<T> e = dq.conjugate() * (i.q.conjugate() * j.q);
    const T wxyz[4] = {e.w(), e.x(), e.y(), e.z()};
    Eigen::Matrix<T, 15, 1> r;
    r.template segment<3>(0) = i.q.conjugate() * Vec<T>(j.p - i.p - i.v * dt - g * dt * dt / 2.0) - between->delta_p().cast<T>() -
                               between->J_p_bg().cast<T>() * dbg - between->J_p_ba().cast<T>() * dba;
    ceres::QuaternionToAngleAxis(wxyz, r.data() + 3);
    r.template segment<3>(6) = i.q.conjugate() * Vec<T>(j.v - i.v - g * dt) - between->delta_v().cast<T>() -
                               between->J_v_bg().cast<T>() * dbg - between->J_v_ba().cast<T>() * dba;
    r.template segment<3>(9) = j.bg - i.bg;
    r.template segment<3>(12) = j.ba - i.ba;
    Eigen::Map<Eigen::Matrix<T, 15, 1>> weighted(out);
    weighted = between->sqrt_information().cast<T>() * r;
    return true;
  }
};

/// |diag(w) d|^2 / 2 on one block.
struct Diagonal {
  Eigen::VectorXd weight;
  template <class T>
  bool operator()(const T* d, T* r) const {
    for (int k = 0; k < weight.size(); ++k) r[k] = weight(k) * d[k];
    return true;
  }
};

struct Standstill {
  NavState state;
  double weight;
  template <class T>
  bool operator()(const T* d, T* r) const {
    for (int k = 0; k < 3; ++k) r[k] = weight * (state.v_WB(k) + d[6 + k]);
    return true;
  }
};

/// The same window for Ceres; parameters are perturbations of the window's states as it is now.
class CeresTwin {
 public:
  explicit CeresTwin(const Window& w) : start_(w.problem) {
    const WindowProblem& p = w.problem;
    for (auto& d : frames_) d.fill(0);
    calibration_.fill(0);
    tilt_ = p.tilt.angle_rad;
    for (const WindowLandmark& l : p.landmarks) landmarks_.push_back(l.alpha_beta_rho);
    problem_.AddParameterBlock(calibration_.data(), 13);
    if (!p.calibrating()) problem_.SetParameterBlockConstant(calibration_.data());
    for (std::size_t k = 0; k < p.landmarks.size(); ++k) add_landmark(p, k);
    for (int j = 1; j < kFrames; ++j)
      problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<Imu, 15, 15, 15, 2>(
                                    new Imu{p.frames[j - 1].state, p.frames[j].state, p.frames[j].imu, p.weights.gravity_mps2}),
                                nullptr, frames_[j - 1].data(), frames_[j].data(), tilt_.data());
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<Diagonal, 2, 2>(new Diagonal{w.tilt_weight}), nullptr,
                              tilt_.data());
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<Diagonal, 15, 15>(new Diagonal{w.frame_weight}), nullptr,
                              frames_[0].data());
    if (p.calibrating())
      problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<Diagonal, 13, 13>(new Diagonal{w.calibration_weight.head<13>()}),
                                nullptr, calibration_.data());
    for (int k = 0; k < kFrames; ++k)
      if (p.frames[k].standstill)
        problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<Standstill, 3, 15>(
                                      new Standstill{p.frames[k].state, 1 / p.weights.standstill_velocity_sigma_mps}),
                                  nullptr, frames_[k].data());
  }

  /// Cost, and residuals with Jacobian (robust weights applied); columns: landmarks, frames, tilt, calibration.
  double evaluate(Eigen::VectorXd& r, Eigen::MatrixXd& J) {
    ceres::Problem::EvaluateOptions options;
    for (Vec3& l : landmarks_) options.parameter_blocks.push_back(l.data());
    for (auto& d : frames_) options.parameter_blocks.push_back(d.data());
    options.parameter_blocks.push_back(tilt_.data());
    if (start_.calibrating()) options.parameter_blocks.push_back(calibration_.data());
    double cost = 0;
    std::vector<double> residuals;
    ceres::CRSMatrix sparse;
    problem_.Evaluate(options, &cost, &residuals, nullptr, &sparse);
    r = Eigen::Map<Eigen::VectorXd>(residuals.data(), static_cast<int>(residuals.size()));
    J.setZero(sparse.num_rows, sparse.num_cols);
    for (int row = 0; row < sparse.num_rows; ++row)
      for (int k = sparse.rows[row]; k < sparse.rows[row + 1]; ++k) J(row, sparse.cols[k]) = sparse.values[k];
    return cost;
  }

  double solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-15;
    options.parameter_tolerance = 1e-14;
    options.gradient_tolerance = 1e-12;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.final_cost;
  }

  NavState state(int k) const { return start_.frames[k].state.boxplus(Eigen::Map<const Vec15>(frames_[k].data())); }
  const Vec2& tilt() const { return tilt_; }
  const Vec3& landmark(int k) const { return landmarks_[k]; }

 private:
  void add_landmark(const WindowProblem& p, std::size_t index) {
    const WindowLandmark& l = p.landmarks[index];
    for (int k = 0; k < l.observation_count; ++k) {
      const WindowObservation& o = p.observations[l.first_observation + k];
      const bool same = o.frame == l.host;
      auto* functor = new Reprojection{p.frames[l.host].state, p.frames[o.frame].state, p.calibration, o, same};
      auto* loss = new ceres::HuberLoss(p.weights.huber_sigma);
      if (same)
        problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<Reprojection, 2, 3, 13>(functor), loss,
                                  landmarks_[index].data(), calibration_.data());
      else
        problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<Reprojection, 2, 15, 15, 3, 13>(functor), loss,
                                  frames_[l.host].data(), frames_[o.frame].data(), landmarks_[index].data(), calibration_.data());
    }
    if (l.belief < 0) return;
    auto* functor = new Belief{{p.frames[l.host].state, {}, p.calibration, {}, false}, p.beliefs[l.belief]};
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<Belief, 3, 15, 3, 13>(functor),
                              new ceres::HuberLoss(p.weights.huber_sigma), frames_[l.host].data(), landmarks_[index].data(),
                              calibration_.data());
  }

  struct Start {
    std::vector<WindowFrame> frames;
    bool calibrating_;
    bool calibrating() const { return calibrating_; }
    explicit Start(const WindowProblem& p) : frames(p.frames), calibrating_(p.calibrating()) {}
  };
  Start start_;
  std::array<std::array<double, 15>, kFrames> frames_;
  Vec2 tilt_;
  std::array<double, 13> calibration_;
  std::vector<Vec3> landmarks_ = [] {
    std::vector<Vec3> v;
    v.reserve(kLandmarks);  // Ceres keeps pointers into it
    return v;
  }();
  ceres::Problem problem_;
};

class WindowTwins : public testing::TestWithParam<bool> {
 protected:
  Window w = test::make_window(GetParam());
  CeresTwin twin{w};
  int dense_size() const { return 15 * kFrames + kTiltSize + (GetParam() ? 13 : 0); }

  /// Column of the Ceres Jacobian (after the landmarks) that is row `row` of our dense system; -1: padding.
  std::vector<int> rows_of_columns() const {
    std::vector<int> rows;
    for (int f = 0; f < kFrames; ++f)
      for (int k = 0; k < 15; ++k) rows.push_back(w.problem.row_of(f, k));
    for (int k = 0; k < kTiltSize; ++k) rows.push_back(w.problem.tilt_row() + k);
    for (int k = 0; GetParam() && k < 13; ++k) rows.push_back(w.problem.calibration_row() + k);
    return rows;
  }
};

TEST_P(WindowTwins, CostIsThatOfCeres) {
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
  const double theirs = twin.evaluate(r, J);
  EXPECT_NEAR(w.problem.cost() / theirs, 1, 1e-10);
  EXPECT_NEAR(w.problem.linearise() / theirs, 1, 1e-10);
  EXPECT_GT(theirs, 100) << "the window is off its optimum";
}

TEST_P(WindowTwins, GaussNewtonStepIsThatOfADenseQr) {
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
  twin.evaluate(r, J);
  const Eigen::VectorXd step = J.householderQr().solve(-r);
  w.problem.linearise();
  ASSERT_TRUE(w.problem.solve(0));
  double dense = 0, points = 0;
  const auto rows = rows_of_columns();
  for (int c = 0; c < dense_size(); ++c) dense = std::max(dense, std::abs(w.problem.step()(rows[c]) - step(3 * kLandmarks + c)));
  for (int k = 0; k < kLandmarks; ++k)
    points = std::max(points, (w.problem.landmark_steps()[k] - step.segment<3>(3 * k)).lpNorm<Eigen::Infinity>());
  EXPECT_LT(dense / step.tail(dense_size()).lpNorm<Eigen::Infinity>(), 1e-6);
  EXPECT_LT(points / step.head(3 * kLandmarks).lpNorm<Eigen::Infinity>(), 1e-6);
}

// With the landmarks' columns first, R of J = Q R holds the reduced information: R22^T R22.
TEST_P(WindowTwins, SchurComplementIsThatOfADenseQr) {
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
  twin.evaluate(r, J);
  const Eigen::MatrixXd R = J.householderQr().matrixQR().triangularView<Eigen::Upper>();
  const int n = dense_size();
  const Eigen::MatrixXd R22 = R.block(3 * kLandmarks, 3 * kLandmarks, n, n);
  const Eigen::MatrixXd by_qr = R22.transpose() * R22;
  w.problem.linearise();
  const Eigen::MatrixXd by_schur = w.problem.reduced_information();
  const auto rows = rows_of_columns();
  double worst = 0;
  for (int a = 0; a < n; ++a)
    for (int b = 0; b < n; ++b)
      worst = std::max(worst, std::abs(by_schur(rows[a], rows[b]) - by_qr(a, b)) / std::sqrt(by_qr(a, a) * by_qr(b, b)));
  EXPECT_LT(worst, 1e-8);
}

TEST_P(WindowTwins, MinimumIsThatOfCeres) {
  LmOptions options;
  options.max_iterations = 100;
  options.min_step = 1e-11;
  options.min_decrease = 0;
  const LmSummary summary = w.problem.optimise(options);
  ASSERT_TRUE(summary.usable);
  const double theirs = twin.solve();
  EXPECT_LT(summary.final_cost, 0.5 * summary.initial_cost);
  EXPECT_NEAR(summary.final_cost / theirs, 1, 1e-6);
  for (int k = 0; k < kFrames; ++k) {
    const Vec15 d = w.problem.frames[k].state.boxminus(twin.state(k));
    EXPECT_LT(d.head<6>().norm(), 1e-6) << "pose of frame " << k;
    EXPECT_LT(d.segment<3>(6).norm(), 1e-5) << "velocity of frame " << k;
    EXPECT_LT(d.tail<6>().norm(), 1e-5) << "biases of frame " << k;
  }
  EXPECT_LT((w.problem.tilt.angle_rad - twin.tilt()).norm(), 1e-6);
  for (int k = 0; k < kLandmarks; ++k)
    EXPECT_LT((w.problem.landmarks[k].alpha_beta_rho - twin.landmark(k)).norm(), 1e-5) << "landmark " << k;
}

/// Frames at rest that see twenty landmarks with both cameras and one, half a metre away, with the left alone.
Window window_at_rest(std::uint64_t seed) {
  Rng rng(seed);
  Window w;
  w.problem.weights.estimate_tilt = false;
  w.problem.calibration.T_BC1.p = Vec3(0.11, 0, 0);
  w.problem.frames.resize(kFrames);
  for (WindowFrame& f : w.problem.frames) f.standstill = true;
  for (int k = 0; k < 20; ++k) {
    const double x = rng.uniform(-2, 2), y = rng.uniform(-1, 1);
    test::add_landmark(w, Vec3(x, y, rng.uniform(3, 6)), 0, rng);
  }
  test::add_landmark(w, Vec3(0.1, 0.1, 0.5), 0, rng);
  WindowLandmark& alone = w.problem.landmarks.back();
  auto& seen = w.problem.observations;
  seen.erase(std::remove_if(seen.begin() + alone.first_observation, seen.end(), [](const auto& o) { return o.right; }),
             seen.end());
  alone.observation_count = static_cast<int>(seen.size()) - alone.first_observation;
  w.problem.prior.quadratic.H = Eigen::MatrixXd::Identity(15, 15) * 1e6;
  w.problem.prior.quadratic.g = Eigen::VectorXd::Zero(15);
  w.problem.prior.frames = {0};
  return w;
}

TEST(WindowAtRest, IsSolvedThoughOneDepthIsNextToFree) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Window w = window_at_rest(seed);
    EXPECT_TRUE(w.problem.optimise(LmOptions{}).usable) << "seed " << seed;
    EXPECT_LT(w.problem.landmarks.back().alpha_beta_rho.z(), 20) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(StatesOnlyAndWithCalibration, WindowTwins, testing::Bool(),
                         [](const auto& one) { return one.param ? "WithCalibration" : "StatesOnly"; });

}  // namespace
}  // namespace fbvins
