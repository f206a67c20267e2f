// SPDX-License-Identifier: Apache-2.0
// For tests: a synthetic window of six frames and fifty landmarks, noisy, off its optimum, with outliers.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/estimator/imu_factor.hpp"
#include "fbvins/estimator/standstill_factor.hpp"
#include "fbvins/estimator/surface_factor.hpp"
#include "fbvins/estimator/window_problem.hpp"
#include "tests/support/imu_test_motion.hpp"

namespace fbvins::test {

inline constexpr int kFrames = 6, kLandmarks = 50;

/// A noisy window off its optimum, with outliers; frame 0 has a prior.
struct Window {
  WindowProblem problem;
  Vec2 tilt_weight;
  Eigen::Matrix<double, 15, 1> frame_weight;
  Eigen::Matrix<double, kCalibrationSize, 1> calibration_weight;
};

inline void remove_factors(WindowProblem& p, std::string_view kind) {
  std::erase_if(p.factors, [&](const auto& factor) { return factor->name() == kind; });
}
/// Of a window problem, those of a kind.
template <class Kind>
std::vector<const Kind*> factors_of(const WindowProblem& p) {
  std::vector<const Kind*> out;
  for (const auto& factor : p.factors)
    if (const auto* one = dynamic_cast<const Kind*>(factor.get())) out.push_back(one);
  return out;
}

inline Vec3 noise3(Rng& rng, double sigma) { return sigma * normal3(rng); }

inline void add_frames(Window& w, const Motion& motion, Rng& rng) {
  const ImuBias bias{Vec3(0.01, -0.02, 0.03), Vec3(0.05, 0.02, -0.04)};
  const auto stamp = [](int k) { return Time{k * 100'000'000}; };
  for (int k = 0; k < kFrames; ++k) {
    WindowFrame frame;
    frame.id = FrameId{k};
    frame.state = motion.state<G>(stamp(k).seconds(), bias);
    if (k > 0) {
      ImuSegment segment = motion.segment(stamp(k - 1), stamp(k), Duration{5'000'000}, bias);
      add_noise(segment, {}, rng);
      Preintegration imu(ImuNoise{}, ImuBias{});
      imu.integrate(segment);
      w.problem.factors.push_back(
          std::make_shared<const ImuFactor>(FrameId{k - 1}, frame.id, std::make_shared<const Preintegration>(std::move(imu))));
    }
    w.problem.frames.push_back(frame);
  }
}

inline void add_landmark(Window& w, const Vec3& p_G, int host, Rng& rng) {
  const Calibration& c = w.problem.calibration;
  const auto in_camera = [&](int frame, bool right) {
    const Vec3 p_B = w.problem.frames[frame].state.T_FB.inverse() * p_G;
    return right ? Vec3(c.T_BC1().inverse() * p_B) : Vec3(c.T_BC0().inverse() * p_B);
  };
  WindowLandmark l;
  l.host = host;
  l.first_observation = static_cast<int>(w.problem.observations.size());
  for (int frame = 0; frame < kFrames; ++frame) {
    for (const bool right : {false, true}) {
      const Vec3 p_C = in_camera(frame, right);
      if (p_C.z() < 0.3) continue;
      WindowObservation o;
      o.frame = frame;
      o.camera = right;
      o.normalised = p_C.head<2>() / p_C.z() + 1e-3 * Vec2(rng.normal(), rng.normal());
      if (rng.below(20) == 0) o.normalised += Vec2(0.02, -0.01);  // an outlier of some ten sigmas
      o.velocity = Vec2(rng.normal(), rng.normal());
      o.rows = 100 * o.normalised.y();
      o.displacement_B = 0.001 * Vec3(frame - 2, right, 1);  // not true, to test the term
      o.sqrt_information << 700, 20, -10, 650;
      w.problem.observations.push_back(o);
      ++l.observation_count;
    }
  }
  l.camera = w.problem.landmarks.size() % 4 == 1;
  const Vec3 p_C = in_camera(host, l.camera);
  l.alpha_beta_rho =
      Vec3(p_C.x() / p_C.z() + 1e-3 * rng.normal(), p_C.y() / p_C.z() + 1e-3 * rng.normal(), (1 + 0.05 * rng.normal()) / p_C.z());
  w.problem.landmarks.push_back(l);
}

/// Places that a frame sees on surfaces of an earlier one, some sigmas off.
inline void add_surfaces(Window& w, int frame, int reference) {
  Rng rng(19);
  std::vector<SurfaceDistance> distances;
  const Pose<B, B> T_rf = w.problem.frames[reference].state.T_FB.inverse() * w.problem.frames[frame].state.T_FB;
  for (int k = 0; k < 25; ++k) {
    const Vec3 p_B = noise3(rng, 2);
    const Vec3 normal_B = noise3(rng, 1).normalized();
    distances.push_back({p_B, normal_B, T_rf * p_B + noise3(rng, 0.02), 80});
  }
  w.problem.factors.push_back(
      std::make_shared<const SurfaceFactor>(w.problem.frames[frame].id, w.problem.frames[reference].id, std::move(distances)));
}

inline Window make_window(bool calibrating) {
  Window w;
  Rng rng(17);
  const Motion motion(0.4, 0.2);
  w.problem.calibration.cameras[0] = {so3_exp(Vec3(0.1, -1.2, 0.3)), Vec3(0.02, -0.03, 0.01)};
  const Pose<C0, C1> T_C0C1(so3_exp(Vec3(0.01, -0.02, 0.005)), Vec3(0.11, 0.001, -0.002));
  w.problem.calibration.cameras[1] = (w.problem.calibration.T_BC0() * T_C0C1).cast_frames<B, C0>();
  add_frames(w, motion, rng);
  while (static_cast<int>(w.problem.landmarks.size()) < kLandmarks) {
    const int host = static_cast<int>(rng.below(kFrames));
    const double depth = rng.uniform(1.5, 8);
    const Vec3 p_C(rng.uniform(-0.6, 0.6) * depth, rng.uniform(-0.4, 0.4) * depth, depth);
    add_landmark(w, w.problem.frames[host].state.T_FB * (w.problem.calibration.T_BC0() * p_C), host, rng);
  }
  Rng prior_rng(18);
  for (int k = 0; k < kLandmarks; k += 3) {  // every third has a prior, a few sigmas off
    WindowLandmark& l = w.problem.landmarks[k];
    LandmarkPrior prior;
    const Vec3 p_B = point_in_host(CameraGeometry(w.problem.calibration), l);
    prior.p_G = w.problem.frames[l.host].state.T_FB * p_B + noise3(prior_rng, 0.05);
    prior.sqrt_information << 40, 5, -3, 0, 25, 2, 0, 0, 60;
    l.prior = static_cast<int>(w.problem.landmark_priors.size());
    w.problem.landmark_priors.push_back(prior);
  }
  for (WindowFrame& f : w.problem.frames) {
    Vec15 d;
    d << noise3(rng, 0.01), noise3(rng, 0.003), noise3(rng, 0.05), noise3(rng, 0.002), noise3(rng, 0.02);
    if (&f != &w.problem.frames[0]) f.state = f.state.boxplus(d);
    f.first_estimate = f.state;
  }
  w.problem.factors.push_back(std::make_shared<const StandstillFactor>(FrameId{3}, 0.5));  // not true, to test the term
  add_surfaces(w, 5, 0);
  w.problem.tilt.angle_rad = Vec2(0.03, -0.02);

  w.tilt_weight << 20, 30;
  w.frame_weight << Vec3::Constant(1e4), Vec3::Constant(1e4), Vec3::Constant(1e2), Vec3::Constant(1e2), Vec3::Constant(10);
  w.calibration_weight.setZero();
  w.calibration_weight.head<14>() << Vec3::Constant(300), Vec3::Constant(300), Vec3::Constant(300), Vec3::Constant(300), 100, 5e3;
  const int calibration_size = calibrating ? kCalibrationSize : 0;
  Eigen::VectorXd weight(kTiltSize + calibration_size + 15);
  weight << w.tilt_weight, w.calibration_weight.head(calibration_size), w.frame_weight;
  w.problem.prior.quadratic.H = weight.cwiseAbs2().asDiagonal();
  w.problem.prior.quadratic.g = Eigen::VectorXd::Zero(weight.size());
  w.problem.prior.frames = {0};
  w.problem.frames[0].in_prior = true;
  w.problem.prior.with_tilt = true;
  w.problem.prior.with_calibration = calibrating;
  w.problem.prior.calibration = w.problem.calibration;
  w.problem.weights.estimate_extrinsics = calibrating;
  w.problem.weights.estimate_time_offset = calibrating;
  w.problem.weights.estimate_line_delay = calibrating;
  return w;
}

}  // namespace fbvins::test
