// SPDX-License-Identifier: Apache-2.0
// Frequency response from recorded input and output by Welch's cross spectra. Pure functions.
//
//   std::vector<FrequencyPoint> measured = frequency_response(torque, rate, 200, frequencies(0.5, 10, 24));
#pragma once

#include <complex>
#include <vector>

namespace fbvins {

struct FrequencyPoint {
  double hz = 0;
  std::complex<double> H;
  double coherence = 0;  ///< share of the output's power that is linear in the input, 0 to 1
};

/// Logarithmically spaced.
std::vector<double> frequencies(double from_hz, double to_hz, int count);

/// Output over input, both sampled evenly at `rate_hz`. Uses differences of consecutive samples, which removes drift.
std::vector<FrequencyPoint> frequency_response(const std::vector<double>& input, const std::vector<double>& output,
                                               double rate_hz, const std::vector<double>& at_hz);

}  // namespace fbvins
