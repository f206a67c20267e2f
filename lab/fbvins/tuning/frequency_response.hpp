// SPDX-License-Identifier: Apache-2.0
// How a signal follows another, frequency by frequency, from one recording of both (Welch's cross spectra). Pure functions.
//
//   std::vector<FrequencyPoint> measured = frequency_response(torque, rate, 200, frequencies(0.5, 10, 24));
#pragma once

#include <complex>
#include <vector>

namespace fbvins {

struct FrequencyPoint {
  double hz = 0;
  std::complex<double> H;
  double coherence = 0;  ///< share of the output that the input explains, 0 to 1
};

/// Spaced evenly on a logarithmic axis.
std::vector<double> frequencies(double from_hz, double to_hz, int count);

/// Output over input. Both are evenly sampled; steps from sample to sample are compared, so that integrals do no harm.
std::vector<FrequencyPoint> frequency_response(const std::vector<double>& input, const std::vector<double>& output,
                                               double rate_hz, const std::vector<double>& at_hz);

}  // namespace fbvins
