// SPDX-License-Identifier: Apache-2.0
// Preintegration: the readings between two instants i and j as one relative motion, with its covariance
// and its derivatives by the biases (docs/derivations/preintegration.md, eq. P1-P16; paper 2.1.2).
//
//   Preintegration between(noise, bias);
//   between.integrate(frame.imu);               // again for each consecutive segment
//   NavState<G> j = between.predict(state_i, gravity_G);
//
// Perturbation order (p, theta, v, bg, ba); delta_p and delta_v are in B_i, theta is right (local).
// Threads: a value; const members may fill a cache, so share one object between threads only by copy.
#pragma once

#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/imu/nav_state.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// Relative motion from B_i to B_j, without gravity.
struct ImuDeltas {
  Quat q = Quat::Identity();  ///< R_BiBj
  Vec3 v = Vec3::Zero();      ///< m/s, in B_i
  Vec3 p = Vec3::Zero();      ///< m, in B_i
};

/// How far a bias may move before the first-order correction is replaced by integrating anew.
struct RepropagationThreshold {
  double gyro_rad = 2e-3;  ///< |d bg| * dt: the second-order error is about half its square
  double accel_mps = 0.2;  ///< |d ba| * dt: exact alone; only its product with the gyro's is of second order
};

/// What is assumed of the signal where readings are missing (eq. P13).
struct ImuGapModel {
  double longest_regular_step = 2.5;   ///< in sampling periods; a longer step is a gap
  double longest_known_step_s = 0.03;  ///< so is this one of a slow IMU: what lies between its readings is not known
  double gyro_sigma_radps = 0.3;       ///< error of the mean rate over a long gap
  double accel_sigma_mps2 = 2.0;       ///< error of the mean specific force over a long gap
  double long_gap_s = 0.1;             ///< shorter gaps: sigmas scaled by (gap / long_gap)^2
};

class Preintegration {
 public:
  Preintegration(const ImuNoise& noise, const ImuBias& linearisation_bias);

  /// Adds readings. The first sample must be the last one of the segment before. An empty segment
  /// adds nothing; over a gap (ImuGapModel) the signal is taken as linear and the covariance inflated.
  void integrate(const ImuSegment& segment);

  /// The interval may end earlier or later, by this standard deviation in seconds: the stamp of an image there has noise (eq.
  /// P11a). `j`: the state at its end, with the gravity of its frame.
  template <class F>
  void loosen_end(double sigma_s, const NavState<F>& j, const Vec3& gravity_F) {
    loosen_end(sigma_s, j.v_B(), j.T_FB.q.conjugate() * gravity_F);
  }

  /// Joins the consecutive interval `later`, integrating its raw readings with this one's bias. The end is that of `later`.
  void append(const Preintegration& later);

  /// Integrates all readings again about another bias.
  void repropagate(const ImuBias& linearisation_bias);
  bool needs_repropagation(const ImuBias& bias, const RepropagationThreshold& threshold = {}) const;

  bool empty() const { return readings_.size() < 2; }
  int size() const { return static_cast<int>(readings_.size()); }
  Duration dt() const { return empty() ? Duration{} : readings_.back().t - readings_.front().t; }
  double dt_s() const { return dt().seconds(); }
  Time begin() const { return empty() ? Time{} : readings_.front().t; }
  Time end() const { return empty() ? Time{} : readings_.back().t; }
  /// The longest gap that overlaps this interval; 0 when there was none.
  double longest_gap_s() const { return longest_gap_s_; }

  const ImuDeltas& deltas() const { return deltas_; }  ///< at the linearisation bias
  const Quat& delta_q() const { return deltas_.q; }
  const Vec3& delta_v() const { return deltas_.v; }
  const Vec3& delta_p() const { return deltas_.p; }
  const ImuBias& linearisation_bias() const { return bias_; }

  /// Deltas at another bias, to first order (eq. P14).
  ImuDeltas corrected(const ImuBias& bias) const;

  const Mat3& J_theta_bg() const { return J_theta_bg_; }
  const Mat3& J_v_bg() const { return J_v_bg_; }
  const Mat3& J_v_ba() const { return J_v_ba_; }
  const Mat3& J_p_bg() const { return J_p_bg_; }
  const Mat3& J_p_ba() const { return J_p_ba_; }

  /// Of (p, theta, v, bg, ba), the last two being the random walk of the biases from i to j.
  Mat15 covariance() const;
  /// Without the end's: over several intervals in a row the noise of stamps cancels, that of readings adds up.
  const Mat15& covariance_of_readings() const { return covariance_; }
  /// Upper-triangular U with U^T U = covariance^-1. Zero while empty().
  const Mat15& sqrt_information() const;

  /// State at j from the state at i (eq. P1).
  template <class F>
  NavState<F> predict(const NavState<F>& i, const Vec3& gravity_F) const {
    const ImuDeltas d = corrected(i.bias);
    const double dt = dt_s();
    NavState<F> j = i;
    j.T_FB.p += dt * i.v_FB + 0.5 * dt * dt * gravity_F + i.T_FB.q * d.p;
    j.v_FB += dt * gravity_F + i.T_FB.q * d.v;
    j.T_FB.q = (i.T_FB.q * d.q).normalized();
    return j;
  }

  /// Covariance of predict(i), in the order of NavState, from that of the state at i, of which attitude and bias are given.
  Mat15 predict_covariance(const Quat& q_FB, const ImuBias& bias, const Mat15& P_i) const;

 private:
  struct Reading {
    Time t;
    Vec3 gyro_radps;
    Vec3 accel_mps2;
    double gap_s;  ///< the IMU gap in which the step up to this reading lies; 0 for a regular step
    ImuNoiseScale noise;
  };

  void loosen_end(double sigma_s, const Vec3& velocity_B, const Vec3& gravity_B);
  void reset(const ImuBias& bias);
  void push(const Reading& reading);
  void step(const Reading& from, const Reading& to);

  ImuNoise noise_;
  ImuGapModel gap_model_;
  ImuBias bias_;
  std::vector<Reading> readings_;
  ImuDeltas deltas_;
  Mat3 J_theta_bg_, J_v_bg_, J_v_ba_, J_p_bg_, J_p_ba_;
  Mat15 covariance_;                                                             ///< without the end's
  Vec3 end_p_ = Vec3::Zero(), end_theta_ = Vec3::Zero(), end_v_ = Vec3::Zero();  ///< loosen_end()'s standard deviation, in B_j
  double longest_gap_s_ = 0;
  mutable Mat15 sqrt_information_;
  mutable bool sqrt_information_valid_ = false;
};

}  // namespace fbvins
