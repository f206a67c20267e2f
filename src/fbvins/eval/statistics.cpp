// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/statistics.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {

double percentile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double at = fraction * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(at);
  const std::size_t high = std::min(low + 1, values.size() - 1);
  return values[low] + (at - static_cast<double>(low)) * (values[high] - values[low]);
}

ErrorStatistics statistics_of(std::vector<double> errors) {
  ErrorStatistics s;
  s.count = static_cast<int>(errors.size());
  if (errors.empty()) return s;
  const auto n = static_cast<double>(errors.size());
  double sum = 0, sum_squares = 0;
  for (double e : errors) {
    sum += e;
    sum_squares += e * e;
    s.max = std::max(s.max, e);
  }
  s.mean = sum / n;
  s.rmse = std::sqrt(sum_squares / n);
  double deviation = 0;  // a second pass: E[e^2] - E[e]^2 would cancel
  for (double e : errors) deviation += (e - s.mean) * (e - s.mean);
  s.std = std::sqrt(deviation / n);
  s.median = percentile(std::move(errors), 0.5);
  return s;
}

}  // namespace fbvins
