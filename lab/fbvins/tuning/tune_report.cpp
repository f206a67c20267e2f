// SPDX-License-Identifier: Apache-2.0
#include "fbvins/tuning/tune_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fbvins/config/option_fields.hpp"
#include "fbvins/config/yaml.hpp"

namespace fbvins {
namespace {

/// A gain that differs between flown and proposed options.
struct Change {
  std::string name;
  double before, after;
};
std::vector<Change> changes(const Tuning& tuning) {
  ControlOptions flown = tuning.flown, proposed = tuning.proposed;
  const std::vector<OptionField> a = fields_of(flown), b = fields_of(proposed);
  std::vector<Change> all;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].is_group()) continue;
    const double before = *std::get<double*>(a[i].value), after = *std::get<double*>(b[i].value);
    if (before != after) all.push_back({std::string(a[i].name()), before, after});
  }
  return all;
}

std::string step_text(const StepResponse& s) {
  return fmt::format("overshoot {:.0f} %, settled after {:.2f} s", 100 * s.overshoot, s.settling_s);
}

// Layout of the plot, pixels.
constexpr double kPanelWidth = 300, kPanelHeight = 200, kGap = 50, kMargin = 40, kTop = 1.6;

std::string polyline(const StepResponse& s, double seconds, double x0, double y0, const char* colour) {
  std::string points;
  const auto every = std::max<std::size_t>(1, s.y.size() / 400);
  for (std::size_t i = 0; i < s.y.size() && s.dt_s * static_cast<double>(i) <= seconds; i += every) {
    const double x = x0 + kPanelWidth * s.dt_s * static_cast<double>(i) / seconds,
                 y = y0 + kPanelHeight * (1 - std::clamp(s.y[i], -0.2, kTop) / kTop);
    points += fmt::format("{:.1f},{:.1f} ", x, y);
  }
  return fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\" points=\"{}\"/>\n", colour, points);
}

std::string panel(const LoopTuning& loop, double x0, double y0) {
  const double length_s = loop.after.dt_s * static_cast<double>(loop.after.y.size());
  const double seconds = std::min(length_s, std::max(4 * loop.after.settling_s, 0.5));
  const auto level = [&](double y) { return y0 + kPanelHeight * (1 - y / kTop); };
  std::string out =
      fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" class=\"t\">{}: step of 1, {:.2f} s</text>\n", x0, y0 - 8, loop.name, seconds);
  out += fmt::format("<rect x=\"{:.0f}\" y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.0f}\" fill=\"none\" stroke=\"#999\"/>\n", x0,
                     y0, kPanelWidth, kPanelHeight);
  for (const double y : {0.95, 1.0, 1.05})
    out += fmt::format("<line x1=\"{:.0f}\" x2=\"{:.0f}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#ccc\"/>\n", x0, x0 + kPanelWidth,
                       level(y), level(y));
  return out + polyline(loop.before, seconds, x0, y0, "#c0504d") + polyline(loop.after, seconds, x0, y0, "#1f77b4");
}

}  // namespace

std::string tuning_text(const Tuning& t, const TuneOptions& options) {
  std::string text = "identified from the log\n";
  constexpr const char *kTurns[] = {"roll", "pitch", "yaw"}, *kWays[] = {"x", "y", "z"};
  for (std::size_t i = 0; i < 3; ++i) {
    const RateFit& f = t.fit.rate[i];
    text += fmt::format(
        "  {:5}  {:6.1f} rad/s^2 at full torque, lag {:.0f} ms, delay {:.0f} ms{}; fits to {:.1f} dB, {:.0f} deg, {:.1f} to {:.1f} Hz\n",
        kTurns[i], f.plant.gain, 1e3 * f.plant.lag_s, 1e3 * f.plant.delay_s,
        i == 2 ? fmt::format(", lead {:.0f} ms", 1e3 * f.plant.lead_s) : "", f.misfit_db, f.misfit_deg, f.points.front().hz,
        f.points.back().hz);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const VelocityFit& f = t.fit.velocity[i];
    text += fmt::format(
        "  {:5}  {:6.2f} of the acceleration setpoint, delay {:.0f} ms, drag {:.2f}/s; fits to {:.1f} dB, {:.0f} deg, {:.1f} to {:.1f} Hz\n",
        kWays[i], f.plant.gain, 1e3 * f.plant.delay_s, f.plant.drag_per_s, f.misfit_db, f.misfit_deg, f.points.front().hz,
        f.points.back().hz);
  }
  text += fmt::format(
      "\nloops: margins as flown -> proposed (wanted: {:.0f} deg), and the predicted step response in angle or position\n",
      options.phase_margin_deg);
  for (const LoopTuning& l : t.loops) {
    text += fmt::format("  {:5}  inner {:.0f} deg at {:.2f} Hz -> {:.0f} at {:.2f}, outer {:.0f} at {:.2f} -> {:.0f} at {:.2f}\n",
                        l.name, l.inner_before.phase_deg, l.inner_before.crossover_hz, l.inner.phase_deg, l.inner.crossover_hz,
                        l.outer_before.phase_deg, l.outer_before.crossover_hz, l.outer.phase_deg, l.outer.crossover_hz);
    text += fmt::format("         {} -> {}{}\n", step_text(l.before), step_text(l.after),
                        l.reachable ? "" : "; no gains within PX4's ranges keep the margins: unchanged");
  }
  text += "\ngains\n";
  for (const Change& c : changes(t)) text += fmt::format("  {:18} {:8.4g} -> {:.4g}\n", c.name, c.before, c.after);
  return text;
}

std::string control_yaml(const ControlOptions& control) {
  ControlOptions copy = control;
  return write_yaml(fields_of(copy));
}

std::string px4_parameter_file(const Tuning& tuning) {
  constexpr int kReal32 = 9;  // MAV_PARAM_TYPE
  std::string text = "# Vehicle-Id Component-Id Name Value Type\n";
  for (const Change& c : changes(tuning)) text += fmt::format("1\t1\t{}\t{:.6g}\t{}\n", c.name, c.after, kReal32);
  return text;
}

std::string tuning_svg(const Tuning& tuning) {
  const double width = 2 * kMargin + 3 * kPanelWidth + 2 * kGap, height = 2 * kMargin + 2 * kPanelHeight + kGap;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{:.0f}\" height=\"{:.0f}\" viewBox=\"0 0 {:.0f} {:.0f}\">\n"
      "<style>.t{{font:13px sans-serif;fill:#333}}</style>\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      width, height, width, height);
  for (std::size_t i = 0; i < tuning.loops.size(); ++i)
    svg += panel(tuning.loops[i], kMargin + static_cast<double>(i % 3) * (kPanelWidth + kGap),
                 kMargin + static_cast<double>(i / 3) * (kPanelHeight + kGap));
  const double x = kMargin + 2 * (kPanelWidth + kGap), y = kMargin + kPanelHeight + kGap + 40;
  svg += fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" class=\"t\" style=\"fill:#c0504d\">as flown</text>\n", x, y);
  svg += fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" class=\"t\" style=\"fill:#1f77b4\">proposed</text>\n", x, y + 22);
  svg += fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" class=\"t\">predicted with the identified vehicle</text>\n</svg>\n", x,
                     y + 44);
  return svg;
}

}  // namespace fbvins
