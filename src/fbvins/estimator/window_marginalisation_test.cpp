// SPDX-License-Identifier: Apache-2.0
// The prior of a frame that leaves: it keeps all information, and has none in the six directions that no sensor
// observes (translation and rotation of the world, gravity with it), also after the states have moved from their first
// estimates.
#include "fbvins/estimator/window_marginalisation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <vector>

#include "fbvins/estimator/window_solver.hpp"
#include "tests/support/window_test_scene.hpp"

namespace fbvins {
namespace window_marginalisation_test {

using test::Window;

/// The window whose landmarks either leave with frame 0 or are not seen from it; without a prior.
struct Scene {
  Window w;
  std::vector<LeavingLandmark> leaving;
};

Scene make_scene(bool with_prior) {
  Scene s{test::make_window(false), {}};
  WindowProblem& p = s.w.problem;
  std::vector<WindowObservation> kept;
  for (std::size_t k = 0; k < p.landmarks.size(); ++k) {
    WindowLandmark& l = p.landmarks[k];
    const bool leaves = l.host == 0 || k % 2 == 0;
    const int first = static_cast<int>(kept.size());
    for (int i = 0; i < l.observation_count; ++i) {
      const WindowObservation& o = p.observations[l.first_observation + i];
      if (leaves || o.frame != 0) kept.push_back(o);
    }
    l.first_observation = first;
    l.observation_count = static_cast<int>(kept.size()) - first;
    if (leaves) s.leaving.push_back({static_cast<int>(k), l.observation_count, false});
  }
  p.observations = kept;
  if (!with_prior) p.prior = {};
  test::remove_factors(p, "standstill");
  for (WindowLandmark& l : p.landmarks) l.prior = -1;  // a known position is not invariant to moves of the world
  return s;
}

/// The window after frame 0 and its landmarks are gone and `prior` has come.
WindowProblem without_first_frame(const WindowProblem& p, const std::vector<LeavingLandmark>& leaving, WindowPrior prior) {
  WindowProblem out;
  out.calibration = p.calibration;
  out.weights = p.weights;
  out.tilt = p.tilt;
  out.frames.assign(p.frames.begin() + 1, p.frames.end());
  out.factors = p.factors;
  std::erase_if(out.factors, [&](const auto& factor) { return factor->touches(p.frames[0].id); });  // they are in the prior
  for (int& frame : prior.frames) {
    WindowFrame& f = out.frames[--frame];
    if (!f.in_prior) f.first_estimate = f.state;
    f.in_prior = true;
  }
  out.prior = std::move(prior);
  for (std::size_t k = 0; k < p.landmarks.size(); ++k) {
    const auto leaves = [&](const LeavingLandmark& l) { return l.index == static_cast<int>(k); };
    if (std::any_of(leaving.begin(), leaving.end(), leaves)) continue;
    WindowLandmark l = p.landmarks[k];
    const int first = static_cast<int>(out.observations.size());
    for (int i = 0; i < l.observation_count; ++i) {
      WindowObservation o = p.observations[l.first_observation + i];
      --o.frame;
      out.observations.push_back(o);
    }
    l.first_observation = first;
    --l.host;
    out.landmarks.push_back(l);
  }
  return out;
}

NavState<G> linearisation_point(const WindowFrame& f) { return f.in_prior ? f.first_estimate : f.state; }

/// Moves of the whole world, as perturbations of the prior's tilt and frames: x, y, z, and rotations about x, y, z; and
/// rotation of the frames about x without gravity, which is observable.
Eigen::MatrixXd world_moves(const WindowProblem& p, const WindowPrior& prior) {
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(prior.quadratic.size(), 7);
  for (std::size_t k = 0; k < prior.frames.size(); ++k) {
    const NavState<G> s = linearisation_point(p.frames[prior.frames[k]]);
    const int at = prior.frames_row() + 15 * static_cast<int>(k);
    N.block<3, 3>(at + nav::p, 0).setIdentity();
    for (int column : {3, 4, 5, 6}) {
      const Vec3 e = Vec3::Unit(column % 3);
      N.block<3, 1>(at + nav::p, column) = e.cross(s.T_FB.p);
      N.block<3, 1>(at + nav::theta, column) = s.T_FB.q.conjugate() * e;
      N.block<3, 1>(at + nav::v, column) = e.cross(s.v_FB);
    }
  }
  // Gravity turns with the world: J dtilt = e x g.
  const Vec3 g = p.tilt.gravity_G(1);
  const Mat32 J = p.tilt.gravity_jacobian(1);
  for (int axis : {0, 1, 2}) N.block<2, 1>(0, 3 + axis) = J.colPivHouseholderQr().solve(Vec3::Unit(axis).cross(g));
  return N;
}

/// Information along n, relative to that of the diagonal of H alone.
double relative_information(const Eigen::MatrixXd& H, const Eigen::VectorXd& n) {
  return n.dot(H * n) / n.cwiseAbs2().dot(H.diagonal());
}

void expect_six_free_directions(const WindowProblem& p, const WindowPrior& prior) {
  const Eigen::MatrixXd N = world_moves(p, prior);
  const Eigen::MatrixXd& H = prior.quadratic.H;
  for (int k = 0; k < 6; ++k) EXPECT_LT(std::abs(relative_information(H, N.col(k))), 1e-11) << "direction " << k;
  EXPECT_GT(relative_information(H, N.col(6)), 1e-7) << "gravity makes roll observable";
}

TEST(Marginalisation, PriorHasNoInformationOnMovesOfTheWorld) {
  const Scene s = make_scene(false);
  MarginalisationMemory memory;
  const WindowPrior prior = marginalise_frame(s.w.problem, 0, s.leaving, memory).prior;
  expect_six_free_directions(s.w.problem, prior);
  const Eigen::VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(prior.quadratic.H).eigenvalues();
  EXPECT_GT(eigenvalues.minCoeff(), -1e-9 * eigenvalues.maxCoeff()) << "never negative";
}

TEST(Marginalisation, PriorHasNoneAfterTheStatesMovedFromTheirFirstEstimates) {
  const Scene s = make_scene(false);
  MarginalisationMemory memory;
  WindowProblem rest = without_first_frame(s.w.problem, s.leaving, marginalise_frame(s.w.problem, 0, s.leaving, memory).prior);
  Rng rng(3);
  for (WindowFrame& f : rest.frames) {
    Vec15 d;
    for (int k = 0; k < 15; ++k) d(k) = 0.02 * rng.normal();
    f.state = f.state.boxplus(d);  // first estimates stay
  }
  std::vector<LeavingLandmark> all;
  for (int k = 0; k < static_cast<int>(rest.landmarks.size()); ++k)
    all.push_back({k, rest.landmarks[k].observation_count, false});
  const WindowPrior prior = marginalise_frame(rest, 0, all, memory).prior;
  expect_six_free_directions(rest, prior);

  // Without first estimates the prior gains information on the heading: the test can fail.
  for (WindowFrame& f : rest.frames) f.first_estimate = f.state;
  const WindowPrior naive = marginalise_frame(rest, 0, all, memory).prior;
  EXPECT_GT(std::abs(relative_information(naive.quadratic.H, world_moves(rest, naive).col(5))), 1e-9);
}

TEST(Marginalisation, KeepsTheStepOfTheFramesThatStay) {
  const Scene s = make_scene(true);
  const WindowProblem& whole = s.w.problem;
  MarginalisationMemory memory;
  const WindowProblem rest = without_first_frame(whole, s.leaving, marginalise_frame(whole, 0, s.leaving, memory).prior);
  const auto step_of = [](const WindowProblem& window) {
    WindowSolver solver;
    WindowInformation information;
    solver.linearise(window);
    EXPECT_TRUE(solver.step(0, information));
    return solver.step().dense;
  };
  const Eigen::VectorXd step = step_of(whole), step_of_rest = step_of(rest);
  const WindowLayout at(whole), at_rest(rest);
  const double size = step.lpNorm<Eigen::Infinity>();
  for (int f = 0; f + 1 < test::kFrames; ++f)
    for (int k = 0; k < 15; ++k)
      EXPECT_NEAR(step_of_rest(at_rest.row_of(f, k)), step(at.row_of(f + 1, k)), 1e-6 * size) << f << " " << k;
}

}  // namespace window_marginalisation_test
}  // namespace fbvins
