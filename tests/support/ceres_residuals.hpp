// SPDX-License-Identifier: Apache-2.0
// For tests: the window's residuals implemented again from their definitions, for Ceres' automatic derivatives.
#pragma once

#include <ceres/jet.h>
#include <ceres/rotation.h>

#include <memory>

#include "fbvins/estimator/surface_factor.hpp"
#include "fbvins/estimator/window_problem.hpp"
#include "fbvins/imu/preintegration.hpp"

namespace fbvins::test {

// All residuals pass through one cost function of one kind of jet: templates of Ceres and Eigen on jets take minutes to compile.
constexpr int kStride = 4;
using Jet = ceres::Jet<double, kStride>;

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

/// A frame's state perturbed by d, of 15 numbers.
template <class T>
struct Moved {
  Vec<T> p, v, bg, ba;
  Q<T> q;
  Moved(const NavState<G>& s, const T* d)
      : p(s.T_FB.p.cast<T>() + Eigen::Map<const Vec<T>>(d)),
        v(s.v_FB.cast<T>() + Eigen::Map<const Vec<T>>(d + 6)),
        bg(s.bias.gyro_radps.cast<T>() + Eigen::Map<const Vec<T>>(d + 9)),
        ba(s.bias.accel_mps2.cast<T>() + Eigen::Map<const Vec<T>>(d + 12)),
        q(s.T_FB.q.cast<T>() * exp(d + 3)) {}
};

/// A residual of some parameter blocks x, for numbers and for jets.
struct Residual {
  virtual ~Residual() = default;
  virtual void evaluate(double const* const* x, double* r) const = 0;
  virtual void evaluate(Jet const* const* x, Jet* r) const = 0;
};

template <class Derived>
struct ResidualOf : Residual {
  void evaluate(double const* const* x, double* r) const override { self().template fill<double>(x, r); }
  void evaluate(Jet const* const* x, Jet* r) const override { self().template fill<Jet>(x, r); }

 private:
  const Derived& self() const { return static_cast<const Derived&>(*this); }
};

/// The only functor that Ceres instantiates.
struct Functor {
  std::unique_ptr<Residual> residual;
  template <class T>
  bool operator()(T const* const* x, T* r) const {
    residual->evaluate(x, r);
    return true;
  }
};

/// The reprojection, from its definition: a point on a ray of one of the host's cameras at depth 1 / rho.
/// Of x = (landmark, calibration), or also (host, target) where these are two frames.
struct Reprojection : ResidualOf<Reprojection> {
  NavState<G> host, target;
  Calibration calibration;
  WindowObservation o;
  bool same_frame = false;
  int camera = 0;  ///< of the ray

  template <class T>
  Vec<T> in_host_body(const T* l, const T* c) const {
    const Vec<T> p_C = Vec<T>(l[0], l[1], T(1)) / l[2];
    const Pose<B, C0> T_BC = calibration.T_BC(camera);
    const T* d = c + 6 * camera;
    return (T_BC.q.cast<T>() * exp(d + 3)) * p_C + T_BC.p.cast<T>() + Eigen::Map<const Vec<T>>(d);
  }
  template <class T>
  Vec<T> in_target_body(T const* const* x) const {
    const Vec<T> p_Bh = in_host_body(x[0], x[1]);
    if (same_frame) return p_Bh;
    const Moved<T> h(host, x[2]), t(target, x[3]);
    return t.q.conjugate() * Vec<T>(h.q * p_Bh + h.p - t.p);
  }
  template <class T>
  void fill(T const* const* x, T* r) const {
    const T* c = x[1];
    const Pose<B, C0> T_BC = calibration.T_BC(o.camera);
    const Vec3 t_BC = T_BC.p + o.displacement_B;
    const Quat q_BC = T_BC.q;
    const T* d = c + 6 * o.camera;
    const Vec<T> t = t_BC.cast<T>() + Eigen::Map<const Vec<T>>(d);
    const Vec<T> p_C = (q_BC.cast<T>() * exp(d + 3)).conjugate() * Vec<T>(in_target_body(x) - t);
    const T offset = T(calibration.time_offset_s) + c[12] + o.rows * (T(calibration.line_delay_s) + c[13]);
    const T e[2] = {p_C.x() / p_C.z() - o.normalised.x() + offset * o.velocity.x(),
                    p_C.y() / p_C.z() - o.normalised.y() + offset * o.velocity.y()};
    for (int k = 0; k < 2; ++k) r[k] = o.sqrt_information(k, 0) * e[0] + o.sqrt_information(k, 1) * e[1];
  }
};

/// The prior of a re-observed landmark (K1), from its definition. Of x = (landmark, calibration, host).
struct LandmarkPriorResidual : ResidualOf<LandmarkPriorResidual> {
  Reprojection seen;
  LandmarkPrior prior;
  template <class T>
  void fill(T const* const* x, T* r) const {
    const Moved<T> h(seen.host, x[2]);
    const Vec<T> away = h.q * seen.in_host_body(x[0], x[1]) + h.p - prior.p_G.cast<T>();
    for (int k = 0; k < 3; ++k) {
      r[k] = T(0);
      for (int i = 0; i < 3; ++i) r[k] += prior.sqrt_information(k, i) * away(i);
    }
  }
};

/// The distance of a place that a frame sees from a surface of another (D4), from its definition. Of x = (frame, reference).
struct Surface : ResidualOf<Surface> {
  NavState<G> frame, reference;
  SurfaceDistance distance;
  template <class T>
  void fill(T const* const* x, T* r) const {
    const Moved<T> f(frame, x[0]), of(reference, x[1]);
    const Vec<T> place_G = f.q * distance.p_B.cast<T>() + f.p;
    const Vec<T> on_it_G = of.q * distance.on_it_B.cast<T>() + of.p;
    const Vec<T> normal_G = of.q * distance.normal_B.cast<T>();
    r[0] = distance.inverse_sigma_1pm * normal_G.dot(place_G - on_it_G);
  }
};

/// The preintegrated readings. Of x = (frame, next frame, tilt).
struct Imu : ResidualOf<Imu> {
  NavState<G> from, to;
  std::shared_ptr<const Preintegration> between;
  double gravity = 0;

  template <class T>
  Vec<T> times(const Mat3& A, const Vec<T>& v) const {
    return {A(0, 0) * v(0) + A(0, 1) * v(1) + A(0, 2) * v(2), A(1, 0) * v(0) + A(1, 1) * v(1) + A(1, 2) * v(2),
            A(2, 0) * v(0) + A(2, 1) * v(1) + A(2, 2) * v(2)};
  }
  template <class T>
  void fill(T const* const* x, T* out) const {
    const Moved<T> i(from, x[0]), j(to, x[1]);
    const T dt(between->dt_s());
    const T turn[3] = {x[2][0], x[2][1], T(0)};
    const Vec<T> g = exp(turn) * Vec<T>(T(0), T(0), T(-gravity));
    const Vec<T> dbg = i.bg - between->linearisation_bias().gyro_radps.cast<T>();
    const Vec<T> dba = i.ba - between->linearisation_bias().accel_mps2.cast<T>();
    const Vec<T> theta = times(between->J_theta_bg(), dbg);
    const Q<T> dq = between->delta_q().cast<T>() * exp(theta.data());
    const Q<T> e = dq.conjugate() * (i.q.conjugate() * j.q);
    const T wxyz[4] = {e.w(), e.x(), e.y(), e.z()};
    const Vec<T> p = Vec<T>(i.q.conjugate() * Vec<T>(j.p - i.p - i.v * dt - g * (dt * dt / T(2)))) -
                     between->delta_p().cast<T>() - times(between->J_p_bg(), dbg) - times(between->J_p_ba(), dba);
    const Vec<T> v = Vec<T>(i.q.conjugate() * Vec<T>(j.v - i.v - g * dt)) - between->delta_v().cast<T>() -
                     times(between->J_v_bg(), dbg) - times(between->J_v_ba(), dba);
    T angle[3];
    ceres::QuaternionToAngleAxis(wxyz, angle);
    T r[15];
    for (int k = 0; k < 3; ++k) {
      r[k] = p(k), r[3 + k] = angle[k], r[6 + k] = v(k);
      r[9 + k] = j.bg(k) - i.bg(k), r[12 + k] = j.ba(k) - i.ba(k);
    }
    const Mat15& U = between->sqrt_information();
    for (int row = 0; row < 15; ++row) {
      out[row] = T(0);
      for (int k = 0; k < 15; ++k) out[row] += U(row, k) * r[k];
    }
  }
};

/// |diag(w) d|^2 / 2 on one block.
struct Diagonal : ResidualOf<Diagonal> {
  Eigen::VectorXd weight;
  template <class T>
  void fill(T const* const* x, T* r) const {
    for (int k = 0; k < weight.size(); ++k) r[k] = weight(k) * x[0][k];
  }
};

struct Standstill : ResidualOf<Standstill> {
  NavState<G> state;
  double weight = 0;
  template <class T>
  void fill(T const* const* x, T* r) const {
    for (int k = 0; k < 3; ++k) r[k] = weight * (state.v_FB(k) + x[0][6 + k]);
  }
};

}  // namespace fbvins::test
