// SPDX-License-Identifier: Apache-2.0
// The five figures of the paper's Table 1 for a list of errors: Max, Mean, Median, RMSE, Std.
// Pure functions, any thread.
//
//   ErrorStatistics s = statistics_of({0.1, 0.3, 0.2});   // s.rmse, s.median, ...
#pragma once

#include <vector>

namespace fbvins {

/// As evo computes them: std over the population (divided by n), median of an even count is the
/// mean of the middle two. All zero when count is 0.
struct ErrorStatistics {
  int count = 0;
  double max = 0;
  double mean = 0;
  double median = 0;
  double rmse = 0;
  double std = 0;
};

ErrorStatistics statistics_of(std::vector<double> errors);

/// Value below which a share of `fraction` in [0, 1] lies, linear between neighbours; 0 for no values.
double percentile(std::vector<double> values, double fraction);

}  // namespace fbvins
