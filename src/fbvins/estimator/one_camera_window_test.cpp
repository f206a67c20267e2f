// SPDX-License-Identifier: Apache-2.0
// One camera's images show everything but the scale: neither covariances nor priors may claim that they do.
#include <gtest/gtest.h>

#include <vector>

#include "fbvins/estimator/window_marginalisation.hpp"
#include "fbvins/estimator/window_solver.hpp"
#include "tests/support/window_test_scene.hpp"

namespace fbvins {
namespace one_camera_window_test {

/// Frames of the window that are not the newest.
constexpr int kOld = test::kFrames - 2;

/// What camera 0 sees of the test's window, without anything else that shows a scale.
WindowProblem one_camera_window(bool with_readings) {
  WindowProblem p = test::make_window(false).problem;
  std::vector<WindowObservation> kept;
  for (WindowLandmark& l : p.landmarks) {
    const int first = static_cast<int>(kept.size());
    for (int i = 0; i < l.observation_count; ++i) {
      WindowObservation o = p.observations[l.first_observation + i];
      o.displacement_B.setZero();
      if (o.camera == 0) kept.push_back(o);
    }
    l.first_observation = first, l.observation_count = static_cast<int>(kept.size()) - first;
    l.prior = -1;
  }
  std::erase_if(p.landmarks, [](const WindowLandmark& l) { return l.camera != 0; });
  p.observations = kept;
  p.weights.images_show_scale = false;
  test::remove_factors(p, "standstill");
  test::remove_factors(p, "surfaces");
  if (!with_readings) test::remove_factors(p, "imu");
  return p;
}

Vec3 centre(const WindowProblem& p, int frame) { return p.frames[frame].state.T_FB * p.calibration.T_BC0().p; }

/// Everything so many times as large, seen from the first frame's camera: the images stay.
WindowProblem scaled(WindowProblem p, double factor) {
  const Vec3 origin = centre(p, 0);
  for (int i = p.frame_count() - 1; i >= 0; --i) {
    p.frames[i].state.T_FB.p += (factor - 1) * (centre(p, i) - origin);
    p.frames[i].state.v_FB *= factor;
  }
  for (WindowLandmark& l : p.landmarks) l.alpha_beta_rho.z() /= factor;
  return p;
}

/// Relative standard deviation of the way from the first to the last frame.
double scale_sigma(const WindowSolution& s) {
  const Vec3 way = s.window.frames.back().state.T_FB.p - s.window.frames.front().state.T_FB.p;
  const std::optional<Mat17> covariance = s.covariance(s.window.frames.back().id);
  return std::sqrt(way.dot(covariance->topLeftCorner<3, 3>() * way)) / way.squaredNorm();
}

TEST(OneCameraWindow, ImagesAloneHaveACovarianceWithoutScale) {
  WindowSolution solution{one_camera_window(false), {}, {}};
  WindowSolver().solve(solution, {});
  EXPECT_GT(scale_sigma(solution), 3);
  // A damping that does not fade is taken for a measurement of the scale: the test can fail.
  solution.window = one_camera_window(false);
  solution.window.weights.images_show_scale = true;
  WindowSolver().solve(solution, {});
  EXPECT_LT(scale_sigma(solution), 1);
}

TEST(OneCameraWindow, AScaleOfAFifthIsRightAfterTwoSteps) {
  WindowSolution right{one_camera_window(true), {}, {}};
  WindowSolver().solve(right, {.max_iterations = 30, .min_decrease = 1e-9});
  const auto way = [](const WindowProblem& p) { return (centre(p, test::kFrames - 1) - centre(p, 0)).norm(); };
  WindowSolution wrong{scaled(right.window, 0.2), {}, {}};
  WindowSolver().solve(wrong, {.max_iterations = 2, .min_decrease = 1e-9});
  EXPECT_NEAR(way(wrong.window) / way(right.window), 1, 1e-3);
}

/// The window after its first frame has left with landmarks as the frames before the newest two see them: those are not in the
/// prior.
WindowProblem without_first_frame(const WindowProblem& p, MarginalisationMemory& memory) {
  std::vector<LeavingLandmark> leaving;
  for (int k = 0; k < static_cast<int>(p.landmarks.size()); ++k) {
    const WindowLandmark& l = p.landmarks[k];
    if (l.host >= kOld || (l.host > 0 && k % 2 == 1)) continue;
    int observations = 0;
    while (observations < l.observation_count && p.observations[l.first_observation + observations].frame < kOld) ++observations;
    leaving.push_back({k, observations, false});
  }
  WindowProblem out = p;
  out.prior = marginalise_frame(p, 0, leaving, memory).prior;
  for (std::size_t i = leaving.size(); i-- > 0;) out.landmarks.erase(out.landmarks.begin() + leaving[i].index);
  for (WindowObservation& o : out.observations) --o.frame;
  // Its observations of landmarks that stay are not in the prior.
  for (WindowLandmark& l : out.landmarks) {
    --l.host;
    while (out.observations[l.first_observation].frame < 0) ++l.first_observation, --l.observation_count;
  }
  std::erase_if(out.factors, [&](const auto& factor) { return factor->touches(p.frames[0].id); });
  out.frames.erase(out.frames.begin());
  for (int& frame : out.prior.frames) {
    WindowFrame& f = out.frames[--frame];
    f.first_estimate = f.state, f.in_prior = true;
  }
  return out;
}

/// Of the prior, along a change of the scale: one over the square of its relative standard deviation.
double information_on_scale(const WindowProblem& p, const WindowPrior& prior) {
  Eigen::VectorXd n = Eigen::VectorXd::Zero(prior.quadratic.size());
  for (std::size_t k = 0; k < prior.frames.size(); ++k)
    n.segment<3>(prior.frames_row() + 15 * static_cast<int>(k) + nav::p) = centre(p, prior.frames[k]) - centre(p, 0);
  return n.dot(prior.quadratic.H * n);
}

TEST(OneCameraWindow, PriorsOfDifferentScalesHaveNoInformationOnTheScale) {
  for (const bool first_estimates : {false, true}) {
    WindowProblem p = one_camera_window(false);
    p.prior = {};
    p.weights.images_show_scale = first_estimates;
    MarginalisationMemory memory;
    const WindowProblem later = scaled(without_first_frame(p, memory), 1.1);
    std::vector<LeavingLandmark> all;
    for (int k = 0; k < static_cast<int>(later.landmarks.size()); ++k)
      all.push_back({k, later.landmarks[k].observation_count, false});
    const double information = information_on_scale(later, marginalise_frame(later, 0, all, memory).prior);
    if (first_estimates) EXPECT_GT(information, 1) << "the test can fail";
    else EXPECT_LT(std::abs(information), 1e-3);
  }
}

}  // namespace one_camera_window_test
}  // namespace fbvins
