// SPDX-License-Identifier: Apache-2.0
#include "fbvins/tuning/loop_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fbvins {
namespace {

constexpr Complex j(0, 1);
Complex delayed(double radps, double delay_s) { return std::polar(1.0, -radps * delay_s); }
Complex lag(double radps, double cutoff_hz) { return 1.0 / (1.0 + j * radps / (2 * std::numbers::pi * cutoff_hz)); }

}  // namespace

Complex butterworth(double radps, double rate_hz, double cutoff_hz) {
  if (cutoff_hz >= 0.5 * rate_hz) return 1;
  const double w =
      std::tan(std::min(0.49 * std::numbers::pi, 0.5 * radps / rate_hz)) / std::tan(std::numbers::pi * cutoff_hz / rate_hz);
  return 1.0 / (1.0 - w * w + j * std::numbers::sqrt2 * w);
}

Complex plant_of(const RatePlant& p, double w) {
  return p.gain * (1.0 + j * w * p.lead_s) * delayed(w, p.delay_s) / (j * w * (1.0 + j * w * p.lag_s));
}

Complex rate_loop(const RatePlant& p, const RateGains& g, const LoopFilters& f, double w) {
  const Complex D = g.D * j * w * butterworth(w, f.rate_hz, f.dgyro_cutoff_hz);
  return plant_of(p, w) * butterworth(w, f.rate_hz, f.gyro_cutoff_hz) * (g.P + g.I / (j * w) + D);
}

Complex angle_loop(const RatePlant& p, const RateGains& g, const LoopFilters& f, double w) {
  const Complex closed = plant_of(p, w) * (g.P + g.I / (j * w)) / (1.0 + rate_loop(p, g, f, w));
  return g.angle_P / (j * w) * closed;
}

Complex angle_response(const RatePlant& p, const RateGains& g, const LoopFilters& f, double w) {
  const Complex open = angle_loop(p, g, f, w);
  return open / (1.0 + open);
}

Complex velocity_plant(const VelocityLoop& loop, double w) {
  const Complex before =
      loop.across ? angle_response(loop.rotor, loop.lean, loop.filters, w) : 1.0 / (1.0 + j * w * loop.rotor.lag_s);
  return loop.plant.gain * delayed(w, loop.plant.delay_s) * before / (j * w + loop.plant.drag_per_s);
}

Complex velocity_loop(const VelocityLoop& loop, const VelocityGains& g, double w) {
  return velocity_plant(loop, w) * (g.P + g.I / (j * w) + g.D * j * w * lag(w, loop.filters.velocity_d_cutoff_hz));
}

Complex position_loop(const VelocityLoop& loop, const VelocityGains& g, double w) {
  const Complex closed = velocity_plant(loop, w) * (g.P + g.I / (j * w)) / (1.0 + velocity_loop(loop, g, w));
  return g.position_P / (j * w) * closed;
}

std::vector<double> margin_grid_radps() {
  std::vector<double> grid;
  constexpr int kPoints = 600;
  for (int i = 0; i < kPoints; ++i) grid.push_back(2 * std::numbers::pi * 0.02 * std::pow(60 / 0.02, i / (kPoints - 1.0)));
  return grid;
}

StabilityMargins margins_of_samples(const std::vector<double>& radps, const std::vector<Complex>& open) {
  StabilityMargins m{180, 1e3, 0};
  bool crossed = false;
  for (std::size_t i = 1; i < open.size(); ++i) {
    const bool above = std::abs(open[i - 1]) >= 1, is_above = std::abs(open[i]) >= 1;
    if (above != is_above) {
      crossed = true;
      m.phase_deg = std::min(m.phase_deg, std::arg(-open[i]) * 180 / std::numbers::pi);
      m.crossover_hz = radps[i] / (2 * std::numbers::pi);
    }
    // -180 degrees: the locus crosses the negative real axis from below.
    const bool half_turn = open[i - 1].imag() < 0 && open[i].imag() >= 0 && open[i].real() < 0;
    if (half_turn && crossed) m.gain = std::min(m.gain, 1 / std::abs(open[i]));
    if (half_turn && !crossed) m.gain = std::min(m.gain, 0.0);  // -180 degrees at a gain above 1
  }
  if (!crossed) m.phase_deg = 180;
  return m;
}

}  // namespace fbvins
