// SPDX-License-Identifier: Apache-2.0
// One window solved by two methods: analytic Jacobians, Schur elimination and Levenberg-Marquardt against
// Ceres with automatic derivatives of independently written residuals, and against a dense QR.
#include <ceres/crs_matrix.h>
#include <ceres/dynamic_autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "fbvins/estimator/window_solver.hpp"
#include "tests/support/ceres_residuals.hpp"
#include "tests/support/window_test_scene.hpp"

namespace fbvins {
namespace window_vs_ceres_test {

using namespace test;  // NOLINT: the residuals and the scene

/// A block of parameters.
struct Block {
  double* x;
  int size;
};

/// The same window for Ceres; parameters are perturbations of the window's states as it is now.
class CeresTwin {
 public:
  explicit CeresTwin(const Window& w) : frames_of_window_(w.problem.frames), calibrating_(w.problem.calibrating()) {
    const WindowProblem& p = w.problem;
    for (auto& d : frames_) d.fill(0);
    calibration_.fill(0);
    tilt_ = p.tilt.angle_rad;
    for (const WindowLandmark& l : p.landmarks) landmarks_.push_back(l.alpha_beta_rho);
    problem_.AddParameterBlock(calibration_.data(), 14);
    if (!calibrating_) problem_.SetParameterBlockConstant(calibration_.data());
    for (std::size_t k = 0; k < p.landmarks.size(); ++k) add_landmark(p, k);
    for (const ImuFactor* factor : test::factors_of<ImuFactor>(p)) {
      const int j = p.index_of(factor->to());
      auto imu = std::make_unique<Imu>();
      imu->from = p.frames[j - 1].state, imu->to = p.frames[j].state;
      imu->between = factor->readings(), imu->gravity = p.weights.gravity_mps2;
      add(std::move(imu), 15, {frame(j - 1), frame(j), tilt_block()});
    }
    add_diagonal(w.tilt_weight, tilt_block());
    add_diagonal(w.frame_weight, frame(0));
    if (calibrating_) add_diagonal(w.calibration_weight.head<14>(), calibration_block());
    for (const StandstillFactor* factor : test::factors_of<StandstillFactor>(p)) {
      const int k = p.index_of(factor->frame());
      auto standstill = std::make_unique<Standstill>();
      standstill->state = p.frames[k].state, standstill->weight = 1 / factor->sigma_mps();
      add(std::move(standstill), 3, {frame(k)});
    }
    for (const SurfaceFactor* factor : test::factors_of<SurfaceFactor>(p)) add_surfaces(p, *factor);
  }

  /// Cost, and residuals with Jacobian (robust weights applied); columns: landmarks, frames, tilt, calibration.
  double evaluate(Eigen::VectorXd& r, Eigen::MatrixXd& J) {
    ceres::Problem::EvaluateOptions options;
    for (Vec3& l : landmarks_) options.parameter_blocks.push_back(l.data());
    for (auto& d : frames_) options.parameter_blocks.push_back(d.data());
    options.parameter_blocks.push_back(tilt_.data());
    if (calibrating_) options.parameter_blocks.push_back(calibration_.data());
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

  NavState<G> state(int k) const { return frames_of_window_[k].state.boxplus(Eigen::Map<const Vec15>(frames_[k].data())); }
  const Vec2& tilt() const { return tilt_; }
  const Vec3& landmark(int k) const { return landmarks_[k]; }

 private:
  Block frame(int k) { return {frames_[k].data(), 15}; }
  Block tilt_block() { return {tilt_.data(), 2}; }
  Block calibration_block() { return {calibration_.data(), 14}; }

  void add(std::unique_ptr<Residual> residual, int size, const std::vector<Block>& blocks, ceres::LossFunction* loss = nullptr) {
    auto* cost = new ceres::DynamicAutoDiffCostFunction<Functor, kStride>(new Functor{std::move(residual)});
    std::vector<double*> x;
    for (const Block& b : blocks) {
      cost->AddParameterBlock(b.size);
      x.push_back(b.x);
    }
    cost->SetNumResiduals(size);
    problem_.AddResidualBlock(cost, loss, x);
  }
  void add_diagonal(const Eigen::VectorXd& weight, const Block& block) {
    auto diagonal = std::make_unique<Diagonal>();
    diagonal->weight = weight;
    add(std::move(diagonal), block.size, {block});
  }
  void add_surfaces(const WindowProblem& p, const SurfaceFactor& factor) {
    const int k = p.index_of(factor.frame()), of = p.index_of(factor.reference());
    for (const SurfaceDistance& distance : factor.distances()) {
      auto surface = std::make_unique<Surface>();
      surface->frame = p.frames[k].state, surface->reference = p.frames[of].state, surface->distance = distance;
      add(std::move(surface), 1, {frame(k), frame(of)}, new ceres::HuberLoss(p.weights.huber_sigma));
    }
  }
  void add_landmark(const WindowProblem& p, std::size_t index) {
    const WindowLandmark& l = p.landmarks[index];
    const Block landmark{landmarks_[index].data(), 3};
    for (int k = 0; k < l.observation_count; ++k) {
      auto seen = std::make_unique<Reprojection>();
      seen->o = p.observations[l.first_observation + k];
      seen->host = p.frames[l.host].state, seen->target = p.frames[seen->o.frame].state;
      seen->calibration = p.calibration;
      seen->same_frame = seen->o.frame == l.host;
      seen->camera = l.camera;
      std::vector<Block> blocks{landmark, calibration_block()};
      if (!seen->same_frame) blocks.insert(blocks.end(), {frame(l.host), frame(seen->o.frame)});
      add(std::move(seen), 2, blocks, new ceres::HuberLoss(p.weights.huber_sigma));
    }
    if (l.prior < 0) return;
    auto residual = std::make_unique<LandmarkPriorResidual>();
    residual->seen.host = p.frames[l.host].state, residual->seen.calibration = p.calibration;
    residual->seen.camera = l.camera;
    residual->prior = p.landmark_priors[l.prior];
    add(std::move(residual), 3, {landmark, calibration_block(), frame(l.host)}, new ceres::HuberLoss(p.weights.huber_sigma));
  }

  std::vector<WindowFrame> frames_of_window_;
  bool calibrating_;
  std::array<std::array<double, 15>, kFrames> frames_;
  Vec2 tilt_;
  std::array<double, 14> calibration_;
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
  WindowSolver solver;
  WindowLayout layout{w.problem};
  int dense_size() const { return 15 * kFrames + kTiltSize + (GetParam() ? 14 : 0); }

  /// For each column of the Ceres Jacobian after the landmarks, its row in our dense system.
  std::vector<int> rows_of_columns() const {
    std::vector<int> rows;
    for (int f = 0; f < kFrames; ++f)
      for (int k = 0; k < 15; ++k) rows.push_back(layout.row_of(f, k));
    for (int k = 0; k < kTiltSize; ++k) rows.push_back(layout.tilt_row() + k);
    for (int k = 0; GetParam() && k < 14; ++k) rows.push_back(layout.calibration_row() + k);
    return rows;
  }
};

TEST_P(WindowTwins, CostIsThatOfCeres) {
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
  const double theirs = twin.evaluate(r, J);
  PairTable pairs;
  EXPECT_NEAR(cost_of(w.problem, pairs) / theirs, 1, 1e-10);
  EXPECT_NEAR(solver.linearise(w.problem) / theirs, 1, 1e-10);
  EXPECT_GT(theirs, 100) << "the window is off its optimum";
}

TEST_P(WindowTwins, GaussNewtonStepIsThatOfADenseQr) {
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
  twin.evaluate(r, J);
  const Eigen::VectorXd step = J.householderQr().solve(-r);
  solver.linearise(w.problem);
  WindowInformation information;
  ASSERT_TRUE(solver.step(0, information));
  double dense = 0, points = 0;
  const auto rows = rows_of_columns();
  for (int c = 0; c < dense_size(); ++c)
    dense = std::max(dense, std::abs(solver.step().dense(rows[c]) - step(3 * kLandmarks + c)));
  for (int k = 0; k < kLandmarks; ++k)
    points = std::max(points, (solver.step().landmarks[k] - step.segment<3>(3 * k)).lpNorm<Eigen::Infinity>());
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
  PairTable pairs;
  NormalEquations equations;
  linearise(w.problem, pairs, equations);
  const Eigen::MatrixXd by_schur = reduced(equations).H;
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
  WindowSolution solution;
  solution.window = w.problem;
  solver.solve(solution, options);
  const LmSummary& summary = solution.summary;
  ASSERT_TRUE(summary.usable);
  const double theirs = twin.solve();
  EXPECT_LT(summary.final_cost, 0.5 * summary.initial_cost);
  EXPECT_NEAR(summary.final_cost / theirs, 1, 1e-6);
  for (int k = 0; k < kFrames; ++k) {
    const Vec15 d = solution.window.frames[k].state.boxminus(twin.state(k));
    EXPECT_LT(d.head<6>().norm(), 1e-6) << "pose of frame " << k;
    EXPECT_LT(d.segment<3>(6).norm(), 1e-5) << "velocity of frame " << k;
    EXPECT_LT(d.tail<6>().norm(), 1e-5) << "biases of frame " << k;
  }
  EXPECT_LT((solution.window.tilt.angle_rad - twin.tilt()).norm(), 1e-6);
  for (int k = 0; k < kLandmarks; ++k)
    EXPECT_LT((solution.window.landmarks[k].alpha_beta_rho - twin.landmark(k)).norm(), 1e-5) << "landmark " << k;
}

/// Frames at rest that see twenty landmarks with both cameras and one, half a metre away, with the left alone.
Window window_at_rest(std::uint64_t seed) {
  Rng rng(seed);
  Window w;
  w.problem.weights.estimate_tilt = false;
  w.problem.calibration.cameras[1].p = Vec3(0.11, 0, 0);
  w.problem.frames.resize(kFrames);
  for (int k = 0; k < kFrames; ++k) {
    w.problem.frames[k].id = FrameId{k};
    w.problem.factors.push_back(std::make_shared<const StandstillFactor>(FrameId{k}));
  }
  for (int k = 0; k < 20; ++k) {
    const double x = rng.uniform(-2, 2), y = rng.uniform(-1, 1);
    test::add_landmark(w, Vec3(x, y, rng.uniform(3, 6)), 0, rng);
  }
  test::add_landmark(w, Vec3(0.1, 0.1, 0.5), 0, rng);
  WindowLandmark& alone = w.problem.landmarks.back();
  auto& seen = w.problem.observations;
  seen.erase(std::remove_if(seen.begin() + alone.first_observation, seen.end(), [](const auto& o) { return o.camera == 1; }),
             seen.end());
  alone.observation_count = static_cast<int>(seen.size()) - alone.first_observation;
  w.problem.prior.quadratic.H = Eigen::MatrixXd::Identity(15, 15) * 1e6;
  w.problem.prior.quadratic.g = Eigen::VectorXd::Zero(15);
  w.problem.prior.frames = {0};
  w.problem.frames[0].in_prior = true;
  return w;
}

TEST(WindowAtRest, IsSolvedThoughOneDepthIsHardlyObservable) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    WindowSolution solution;
    solution.window = window_at_rest(seed).problem;
    WindowSolver().solve(solution, LmOptions{});
    EXPECT_TRUE(solution.summary.usable) << "seed " << seed;
    EXPECT_LT(solution.window.landmarks.back().alpha_beta_rho.z(), 20) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(StatesOnlyAndWithCalibration, WindowTwins, testing::Bool(),
                         [](const auto& one) { return one.param ? "WithCalibration" : "StatesOnly"; });

}  // namespace window_vs_ceres_test
}  // namespace fbvins
