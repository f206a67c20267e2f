// SPDX-License-Identifier: Apache-2.0
// The loops of loop_model.hpp in the time domain: the vehicle in steps of a millisecond, the controller at its own rate.
#include <algorithm>
#include <cmath>

#include "fbvins/flight/control_filters.hpp"
#include "fbvins/tuning/loop_model.hpp"

namespace fbvins {
namespace {

constexpr double kStep_s = 1e-3, kSettled = 0.05, kRisen = 0.9;
constexpr double kDiverged = 20;

/// A pure delay.
class DelayLine {
 public:
  explicit DelayLine(double delay_s) : kept_(static_cast<std::size_t>(std::lround(std::max(0.0, delay_s) / kStep_s)) + 1, 0.0) {}
  double operator()(double x) {
    kept_[at_] = x;
    at_ = (at_ + 1) % kept_.size();
    return kept_[at_];
  }

 private:
  std::vector<double> kept_;
  std::size_t at_ = 0;
};

/// From torque to angle, with the rate and angle loops closed around it.
class LeaningAxis {
 public:
  LeaningAxis(const RatePlant& plant, const RateGains& gains, const LoopFilters& f)
      : plant_(plant),
        gains_(gains),
        // The zero-order hold of the command is already a delay of half a period.
        delay_(plant.delay_s - 0.5 / f.rate_hz),
        period_s_(1 / f.rate_hz),
        rate_filter_(f.rate_hz, f.gyro_cutoff_hz),
        d_filter_(f.rate_hz, f.dgyro_cutoff_hz) {}

  void control(double wanted_angle) {
    const Vec3 rate = rate_filter_(Vec3(rate_, 0, 0));
    const double acceleration = d_filter_(Vec3((rate.x() - last_) / period_s_, 0, 0)).x();
    last_ = rate.x();
    const double error = gains_.angle_P * (wanted_angle - angle_) - rate.x();
    torque_ = gains_.P * error + integral_ - gains_.D * acceleration;
    integral_ += gains_.I * error * period_s_;
  }
  void move() {
    const double asked = delay_(torque_), lag_s = std::max(plant_.lag_s, kStep_s), before = given_;
    given_ += (asked - given_) * (1 - std::exp(-kStep_s / lag_s));
    rate_ += plant_.gain * (kStep_s * given_ + plant_.lead_s * (given_ - before));
    angle_ += kStep_s * rate_;
  }
  double angle() const { return angle_; }

 private:
  RatePlant plant_;
  RateGains gains_;
  DelayLine delay_;
  double period_s_;
  ButterworthFilter rate_filter_, d_filter_;
  double last_ = 0, integral_ = 0, torque_ = 0, given_ = 0, rate_ = 0, angle_ = 0;
};

/// Calls control() once per period and move() at every step, with y limited to +-kDiverged.
template <class Control, class Move>
StepResponse run(double seconds, double rate_hz, Control&& control, Move&& move) {
  std::vector<double> y;
  const auto count = static_cast<int>(seconds / kStep_s), every = static_cast<int>(std::lround(1 / (rate_hz * kStep_s)));
  for (int i = 0; i < count; ++i) {
    if (i % every == 0) control();
    y.push_back(move());
    if (!(std::abs(y.back()) < kDiverged)) y.back() = std::copysign(kDiverged, y.back());
  }
  return judged(std::move(y), kStep_s);
}

}  // namespace

StepResponse judged(std::vector<double> y, double dt_s) {
  StepResponse r;
  r.dt_s = dt_s;
  const double length_s = dt_s * static_cast<double>(y.size());
  r.settling_s = 0, r.rise_s = length_s;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double t = dt_s * static_cast<double>(i + 1);
    r.overshoot = std::max(r.overshoot, y[i] - 1);
    if (std::abs(y[i] - 1) > kSettled) r.settling_s = t;
    if (y[i] > kRisen) r.rise_s = std::min(r.rise_s, t);
  }
  r.y = std::move(y);
  return r;
}

StepResponse angle_step(const RatePlant& plant, const RateGains& gains, const LoopFilters& filters, double seconds) {
  LeaningAxis axis(plant, gains, filters);
  return run(
      seconds, filters.rate_hz, [&] { axis.control(1); },
      [&] {
        axis.move();
        return axis.angle();
      });
}

StepResponse position_step(const VelocityLoop& loop, const VelocityGains& g, double seconds) {
  LeaningAxis axis(loop.rotor, loop.lean, loop.filters);
  const double period_s = 1 / loop.filters.rate_hz, lag_s = std::max(loop.rotor.lag_s, kStep_s);
  DelayLine seen(loop.plant.delay_s), seen_p(loop.plant.delay_s);
  LagFilter d_filter(loop.filters.rate_hz, loop.filters.velocity_d_cutoff_hz);
  double v = 0, p = 0, v_seen = 0, p_seen = 0, last = 0, integral = 0, asked = 0, risen = 0;
  return run(
      seconds, loop.filters.rate_hz,
      [&] {
        const double acceleration = d_filter(Vec3((v_seen - last) / period_s, 0, 0)).x();
        last = v_seen;
        const double error = g.position_P * (1 - p_seen) - v_seen;
        asked = g.P * error + integral - g.D * acceleration;
        integral += g.I * error * period_s;
        if (loop.across) axis.control(asked);
      },
      [&] {
        risen += (asked - risen) * (1 - std::exp(-kStep_s / lag_s));
        if (loop.across) axis.move();
        v += kStep_s * (loop.plant.gain * (loop.across ? axis.angle() : risen) - loop.plant.drag_per_s * v);
        p += kStep_s * v;
        v_seen = seen(v), p_seen = seen_p(p);
        return p;
      });
}

}  // namespace fbvins
