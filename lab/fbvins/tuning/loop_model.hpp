// SPDX-License-Identifier: Apache-2.0
// One axis of a vehicle as its control loops see it: from torque to rate, from an acceleration that is asked for to velocity; and
// what controllers of PX4's structure make of it. Laplace's s, seconds, radians. Pure functions.
#pragma once

#include <complex>
#include <vector>

namespace fbvins {

/// rate / torque = gain (1 + lead s) e^(-delay s) / (s (1 + lag s)).
struct RatePlant {
  double gain = 1;  ///< rad/s^2 of a full torque
  double lag_s = 0, delay_s = 0, lead_s = 0;
};
/// velocity / asked acceleration = gain e^(-delay s) / (s + drag), behind the attitude loop across, behind the rotors' lag
/// upwards.
struct VelocityPlant {
  double gain = 1, delay_s = 0, drag_per_s = 0;
};

/// Filters and pace of the controller.
struct LoopFilters {
  double rate_hz = 200;
  double gyro_cutoff_hz = 30, dgyro_cutoff_hz = 20;
  double velocity_d_cutoff_hz = 5;
};

struct RateGains {
  double P = 0, I = 0, D = 0;
  double angle_P = 0;  ///< of the loop around it
};
struct VelocityGains {
  double P = 0, I = 0, D = 0;
  double position_P = 0;
};

using Complex = std::complex<double>;
/// The low pass of ButterworthFilter at this frequency.
Complex butterworth(double radps, double rate_hz, double cutoff_hz);

Complex plant_of(const RatePlant& plant, double radps);
Complex rate_loop(const RatePlant& plant, const RateGains& gains, const LoopFilters& filters, double radps);       ///< open
Complex angle_loop(const RatePlant& plant, const RateGains& gains, const LoopFilters& filters, double radps);      ///< open
Complex angle_response(const RatePlant& plant, const RateGains& gains, const LoopFilters& filters, double radps);  ///< closed

/// An axis across leans by `lean`; without, it is the axis upwards with the rotors' lag.
struct VelocityLoop {
  VelocityPlant plant;
  RatePlant rotor;
  RateGains lean;
  bool across = true;
  LoopFilters filters;
};
Complex velocity_plant(const VelocityLoop& loop, double radps);                             ///< velocity / asked acceleration
Complex velocity_loop(const VelocityLoop& loop, const VelocityGains& gains, double radps);  ///< open
Complex position_loop(const VelocityLoop& loop, const VelocityGains& gains, double radps);  ///< open

/// How far an open loop is from instability.
struct Margins {
  double phase_deg = -180;  ///< least at any gain of one
  double gain = 0;          ///< least factor to a gain of one where the phase is half a turn, above the crossover
  double crossover_hz = 0;  ///< the last one
};
template <class OpenLoop>
Margins margins_of(OpenLoop&& open);

/// A step of one.
struct StepResponse {
  double dt_s = 0;
  std::vector<double> y;
  double overshoot = 0;   ///< share of the step
  double settling_s = 0;  ///< until it stays within 5 %; the whole length where it does not
  double rise_s = 0;      ///< to 90 %
};
StepResponse judged(std::vector<double> y, double dt_s);
StepResponse angle_step(const RatePlant& plant, const RateGains& gains, const LoopFilters& filters, double seconds);
StepResponse position_step(const VelocityLoop& loop, const VelocityGains& gains, double seconds);

/// At 600 frequencies from 0.02 Hz to 60 Hz.
std::vector<double> margin_grid_radps();
Margins margins_of_samples(const std::vector<double>& radps, const std::vector<Complex>& open);
template <class OpenLoop>
Margins margins_of(OpenLoop&& open) {
  const std::vector<double> grid = margin_grid_radps();
  std::vector<Complex> samples;
  samples.reserve(grid.size());
  for (const double w : grid) samples.push_back(open(w));
  return margins_of_samples(grid, samples);
}

}  // namespace fbvins
