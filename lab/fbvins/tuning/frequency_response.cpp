// SPDX-License-Identifier: Apache-2.0
#include "fbvins/tuning/frequency_response.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fbvins {
namespace {

using Complex = std::complex<double>;
constexpr double kSegment_s = 4, kHop_s = 0.5;

std::vector<double> differences(const std::vector<double>& x) {
  std::vector<double> d;
  for (std::size_t i = 1; i < x.size(); ++i) d.push_back(x[i] - x[i - 1]);
  return d;
}

/// Fourier coefficient of a segment with a Hann window at one frequency.
Complex amplitude(const std::vector<double>& x, std::size_t begin, std::size_t length, double radians_per_sample) {
  double mean = 0;
  for (std::size_t i = 0; i < length; ++i) mean += x[begin + i] / static_cast<double>(length);
  const Complex turn = std::polar(1.0, -radians_per_sample);
  Complex phasor = 1, sum = 0;
  for (std::size_t i = 0; i < length; ++i, phasor *= turn) {
    const double window =
        0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(length));
    sum += window * (x[begin + i] - mean) * phasor;
  }
  return sum;
}

}  // namespace

std::vector<double> frequencies(double from_hz, double to_hz, int count) {
  std::vector<double> all;
  for (int i = 0; i < count; ++i) all.push_back(from_hz * std::pow(to_hz / from_hz, i / (count - 1.0)));
  return all;
}

std::vector<FrequencyPoint> frequency_response(const std::vector<double>& input, const std::vector<double>& output,
                                               double rate_hz, const std::vector<double>& at_hz) {
  const std::vector<double> u = differences(input), y = differences(output);
  const auto length = static_cast<std::size_t>(kSegment_s * rate_hz), hop = static_cast<std::size_t>(kHop_s * rate_hz);
  std::vector<FrequencyPoint> points;
  for (const double hz : at_hz) {
    const double w = 2 * std::numbers::pi * hz / rate_hz;
    double uu = 0, yy = 0;
    Complex yu = 0;
    for (std::size_t begin = 0; begin + length <= std::min(u.size(), y.size()); begin += hop) {
      const Complex U = amplitude(u, begin, length, w), Y = amplitude(y, begin, length, w);
      uu += std::norm(U), yy += std::norm(Y), yu += Y * std::conj(U);
    }
    if (uu <= 0 || yy <= 0) continue;
    points.push_back({hz, yu / uu, std::norm(yu) / (uu * yy)});
  }
  return points;
}

}  // namespace fbvins
