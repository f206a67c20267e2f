// SPDX-License-Identifier: Apache-2.0
// Huber loss of the norm of a whitened residual.
#pragma once

#include <cmath>

namespace fbvins {

struct RobustValue {
  double cost;    ///< contribution to the objective: rho(|r|^2) / 2
  double weight;  ///< factor on J^T J and J^T r (iteratively reweighted least squares)
};

/// Quadratic up to |r| = threshold, linear beyond.
inline RobustValue huber(double squared_norm, double threshold) {
  if (squared_norm <= threshold * threshold) return {0.5 * squared_norm, 1.0};
  const double norm = std::sqrt(squared_norm);
  return {threshold * (norm - 0.5 * threshold), threshold / norm};
}

}  // namespace fbvins
