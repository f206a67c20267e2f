// SPDX-License-Identifier: Apache-2.0
#include "fbvins/tuning/gain_design.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

constexpr double kGainMargin = 2;
constexpr double kAngle_s = 2, kYaw_s = 4, kPosition_s = 6;
constexpr int kSizes = 48;  ///< number of gains tried between the ends of a range

using GainRanges = std::array<GainRange, 4>;
enum : std::size_t { kP, kI, kD, kOuter };

double clamped(double x, const GainRange& range) { return std::clamp(x, range.least, range.most); }

/// Search over the gains of one loop pair, common to rate/angle and velocity/position.
template <class Gains, class Inner, class Outer, class Step>
struct Search {
  GainRanges ranges;
  std::vector<double> integral_per_P, derivative_per_P;
  TuneOptions options;
  Inner inner;
  Outer outer;
  Step step;

  bool keeps(const StabilityMargins& m) const { return m.phase_deg >= options.phase_margin_deg && m.gain >= kGainMargin; }

  /// The largest P with these ratios that keeps the margins; 0 if none does.
  double largest(double integral, double derivative, double Gains::*outer_gain) const {
    for (int i = 0; i < kSizes; ++i) {
      Gains g;
      g.P = ranges[kP].most * std::pow(ranges[kP].least / ranges[kP].most, i / (kSizes - 1.0));
      g.I = integral * g.P, g.D = derivative * g.P;
      g.*outer_gain = 0;
      if (g.D > ranges[kD].most || g.I > ranges[kI].most) continue;
      if (keeps(margins_of([&](double w) { return inner(g, w); }))) return g.P;
    }
    return 0;
  }

  /// The gains whose step response settles first; `found`: whether there are any.
  Gains best(double Gains::*outer_gain, bool& found) const {
    Gains chosen;
    double least_s = 1e9;
    found = false;
    for (const double integral : integral_per_P)
      for (const double derivative : derivative_per_P) {
        Gains g;
        g.P = largest(integral, derivative, outer_gain);
        if (g.P == 0) continue;
        // If the outer gain is at the limit of its range, a slower inner loop can settle sooner.
        for (const double share : {1.0, 0.8, 0.65, 0.5, 0.4, 0.3, 0.22, 0.16}) {
          Gains h;
          h.P = clamped(share * g.P, ranges[kP]);
          h.I = integral * h.P, h.D = derivative * h.P;
          for (int i = 0; i < 24; ++i) {
            h.*outer_gain = ranges[kOuter].most * std::pow(ranges[kOuter].least / ranges[kOuter].most, i / 23.0);
            if (!keeps(margins_of([&](double w) { return outer(h, w); }))) continue;
            const StepResponse s = step(h);
            if (s.overshoot > options.overshoot || s.settling_s >= 0.98 * least_s) continue;
            least_s = s.settling_s, chosen = h, found = true;
          }
        }
      }
    return chosen;
  }
};
template <class Gains, class Inner, class Outer, class Step>
Search<Gains, Inner, Outer, Step> search_of(GainRanges ranges, std::vector<double> integral, std::vector<double> derivative,
                                            const TuneOptions& options, Inner inner, Outer outer, Step step) {
  return {ranges, std::move(integral), std::move(derivative), options, inner, outer, step};
}

RateGains tune_angle(LoopTuning& loop, const RatePlant& plant, const LoopFilters& filters, const RateGains& flown, bool yaw,
                     const TuneOptions& options) {
  const double seconds = yaw ? kYaw_s : kAngle_s;
  const auto inner = [&](const RateGains& g, double w) { return rate_loop(plant, g, filters, w); };
  const auto outer = [&](const RateGains& g, double w) { return angle_loop(plant, g, filters, w); };
  const auto step = [&](const RateGains& g) { return angle_step(plant, g, filters, seconds); };
  const std::vector<double> derivatives = yaw ? std::vector<double>{0} : std::vector<double>{0, 0.01, 0.02, 0.03, 0.04};
  RateGains g = search_of<RateGains>(px4_ranges(loop.name), {0.5, 1, 1.5, 2.5}, derivatives, options, inner, outer, step)
                    .best(&RateGains::angle_P, loop.reachable);
  if (!loop.reachable) g = flown;
  const auto margins = [&](const RateGains& of, StabilityMargins& in, StabilityMargins& out) {
    in = margins_of([&](double w) { return inner(of, w); });
    out = margins_of([&](double w) { return outer(of, w); });
  };
  margins(flown, loop.inner_before, loop.outer_before);
  margins(g, loop.inner, loop.outer);
  loop.before = step(flown);
  loop.after = step(g);
  return g;
}

VelocityGains tune_position(LoopTuning& loop, const VelocityLoop& before, const VelocityLoop& now, const VelocityGains& flown,
                            const TuneOptions& options) {
  const auto inner = [&](const VelocityGains& g, double w) { return velocity_loop(now, g, w); };
  const auto outer = [&](const VelocityGains& g, double w) { return position_loop(now, g, w); };
  const auto step = [&](const VelocityGains& g) { return position_step(now, g, kPosition_s); };
  const std::vector<double> derivatives = now.across ? std::vector<double>{0, 0.05, 0.1, 0.15} : std::vector<double>{0};
  VelocityGains g =
      search_of<VelocityGains>(px4_ranges(loop.name), {0.1, 0.2, 0.35, 0.5}, derivatives, options, inner, outer, step)
          .best(&VelocityGains::position_P, loop.reachable);
  if (!loop.reachable) g = flown;
  loop.inner_before = margins_of([&](double w) { return velocity_loop(before, flown, w); });
  loop.outer_before = margins_of([&](double w) { return position_loop(before, flown, w); });
  loop.inner = margins_of([&](double w) { return inner(g, w); });
  loop.outer = margins_of([&](double w) { return outer(g, w); });
  loop.before = position_step(before, flown, kPosition_s);
  loop.after = step(g);
  return g;
}

}  // namespace

std::array<GainRange, 4> px4_ranges(const std::string& loop) {
  if (loop == "yaw") return {{{0.02, 0.6}, {0, 1.0}, {0, 0}, {0.5, 5}}};
  if (loop == "xy") return {{{0.6, 5}, {0, 10}, {0, 2}, {0.2, 2}}};
  if (loop == "z") return {{{1, 15}, {0, 10}, {0, 2}, {0.2, 1.5}}};
  return {{{0.01, 0.5}, {0, 2.0}, {0, 0.01}, {1, 12}}};
}

Tuning tune(const LoopLog& log, const VehicleFit& fit, const TuneOptions& options) {
  Tuning t;
  t.fit = fit;
  t.flown = t.proposed = log.control;
  const LoopFilters filters = filters_of(log);
  constexpr const char* kNames[] = {"roll", "pitch", "yaw", "xy", "z"};
  std::array<RateGains, 3> lean;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    t.loops[i].name = kNames[i];
    lean[i] = tune_angle(t.loops[i], fit.rate[i].plant, filters, rate_gains(log.control, axis), axis == 2, options);
  }
  // x and y share their gains: the axis with the longer delay decides.
  const std::size_t slower = fit.velocity[0].plant.delay_s >= fit.velocity[1].plant.delay_s ? 0 : 1, rotation_axis = 1 - slower;
  const VelocityPlant &across = fit.velocity[slower].plant, &up = fit.velocity[2].plant;
  const RateGains flown_rotation = rate_gains(log.control, static_cast<int>(rotation_axis));
  t.loops[3].name = std::string(kNames[3]), t.loops[4].name = std::string(kNames[4]);
  const VelocityGains xy = tune_position(t.loops[3], {across, fit.rate[rotation_axis].plant, flown_rotation, true, filters},
                                         {across, fit.rate[rotation_axis].plant, lean[rotation_axis], true, filters},
                                         velocity_gains(log.control, 0), options);
  const VelocityLoop z_loop{up, fit.rate[0].plant, lean[0], false, filters};
  const VelocityGains z = tune_position(t.loops[4], z_loop, z_loop, velocity_gains(log.control, 2), options);

  RateControlOptions& r = t.proposed.rate;
  AttitudeControlOptions& a = t.proposed.attitude;
  PositionControlOptions& p = t.proposed.position;
  r.MC_ROLLRATE_P = lean[0].P, r.MC_ROLLRATE_I = lean[0].I, r.MC_ROLLRATE_D = lean[0].D, a.MC_ROLL_P = lean[0].angle_P;
  r.MC_PITCHRATE_P = lean[1].P, r.MC_PITCHRATE_I = lean[1].I, r.MC_PITCHRATE_D = lean[1].D, a.MC_PITCH_P = lean[1].angle_P;
  r.MC_YAWRATE_P = lean[2].P, r.MC_YAWRATE_I = lean[2].I, r.MC_YAWRATE_D = lean[2].D, a.MC_YAW_P = lean[2].angle_P;
  p.MPC_XY_VEL_P_ACC = xy.P, p.MPC_XY_VEL_I_ACC = xy.I, p.MPC_XY_VEL_D_ACC = xy.D, p.MPC_XY_P = xy.position_P;
  p.MPC_Z_VEL_P_ACC = z.P, p.MPC_Z_VEL_I_ACC = z.I, p.MPC_Z_VEL_D_ACC = z.D, p.MPC_Z_P = z.position_P;
  return t;
}

}  // namespace fbvins
