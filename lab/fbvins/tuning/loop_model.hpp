// SPDX-License-Identifier: Apache-2.0
// Linear model of one axis: from torque to rate, from acceleration setpoint to velocity, and the loops that controllers of PX4's
// structure close around it. s is the Laplace variable; seconds, radians. Pure functions.
#pragma once

#include <complex>
#include <vector>

namespace fbvins {

/// rate / torque = gain (1 + lead s) e^(-delay s) / (s (1 + lag s)).
struct RatePlant {
  double gain = 1;  ///< rad/s^2 at full torque
  double lag_s = 0, delay_s = 0, lead_s = 0;
};
/// velocity / acceleration setpoint = gain e^(-delay s) / (s + drag), in series with the attitude loop (horizontally) or the
/// rotors' lag (vertically).
struct VelocityPlant {
  double gain = 1, delay_s = 0, drag_per_s = 0;
};

/// Filters and rate of the controller.
struct LoopFilters {
  double rate_hz = 200;
  double gyro_cutoff_hz = 30, dgyro_cutoff_hz = 20;
  double velocity_d_cutoff_hz = 5;
};

struct RateGains {
  double P = 0, I = 0, D = 0;
  double angle_P = 0;  ///< of the outer loop
};
struct VelocityGains {
  double P = 0, I = 0, D = 0;
  double position_P = 0;
};

using Complex = std::complex<double>;
/// Frequency response of ButterworthFilter.
Complex butterworth(double radps, double rate_hz, double cutoff_hz);

Complex plant_of(const RatePlant& plant, double radps);
Complex rate_loop(const RatePlant& plant, const RateGains& gains, const LoopFilters& filters, double radps);       ///< open
Complex angle_loop(const RatePlant& plant, const RateGains& gains, const LoopFilters& filters, double radps);      ///< open
Complex angle_response(const RatePlant& plant, const RateGains& gains, const LoopFilters& filters, double radps);  ///< closed

/// `across`: a horizontal axis, moved by tilting with the plant `rotor` and the gains `lean`; else vertical, with `rotor`'s lag.
struct VelocityLoop {
  VelocityPlant plant;
  RatePlant rotor;
  RateGains lean;
  bool across = true;
  LoopFilters filters;
};
Complex velocity_plant(const VelocityLoop& loop, double radps);                             ///< velocity / acceleration setpoint
Complex velocity_loop(const VelocityLoop& loop, const VelocityGains& gains, double radps);  ///< open
Complex position_loop(const VelocityLoop& loop, const VelocityGains& gains, double radps);  ///< open

/// Stability margins of an open loop.
struct StabilityMargins {
  double phase_deg = -180;  ///< smallest of all crossovers
  double gain = 0;          ///< smallest factor to a gain of 1 where the phase is -180 degrees, above the crossover
  double crossover_hz = 0;  ///< of the last crossover (gain of 1)
};
template <class OpenLoop>
StabilityMargins margins_of(OpenLoop&& open);

/// Response to a unit step.
struct StepResponse {
  double dt_s = 0;
  std::vector<double> y;
  double overshoot = 0;   ///< share of the step
  double settling_s = 0;  ///< until it stays within 5 %; the whole length if it does not
  double rise_s = 0;      ///< to 90 %
};
StepResponse judged(std::vector<double> y, double dt_s);
StepResponse angle_step(const RatePlant& plant, const RateGains& gains, const LoopFilters& filters, double seconds);
StepResponse position_step(const VelocityLoop& loop, const VelocityGains& gains, double seconds);

/// At 600 frequencies from 0.02 Hz to 60 Hz.
std::vector<double> margin_grid_radps();
StabilityMargins margins_of_samples(const std::vector<double>& radps, const std::vector<Complex>& open);
template <class OpenLoop>
StabilityMargins margins_of(OpenLoop&& open) {
  const std::vector<double> grid = margin_grid_radps();
  std::vector<Complex> samples;
  samples.reserve(grid.size());
  for (const double w : grid) samples.push_back(open(w));
  return margins_of_samples(grid, samples);
}

}  // namespace fbvins
