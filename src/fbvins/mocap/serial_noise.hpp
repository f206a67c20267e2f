// SPDX-License-Identifier: Apache-2.0
// Errors that are correlated in time: white noise plus a first-order Gauss-Markov process, the part that "wanders", and
// least squares weighted accordingly. Pure functions, any thread.
//
//   NormalSums sums = whitened_sums(noise, stamps_s, rows);    // rows: Jacobian | residual, in order of time
//   SerialNoise fitted = fit_serial_noise(...);                // by restricted likelihood
//
// Formulas: docs/derivations/hand_eye.md. The whitening is a scalar Kalman filter that runs over every column alike, so that its
// innovations are the rows multiplied by the inverse square root of the covariance, in linear time.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace fbvins {

struct SerialNoise {
  double white = 1;     ///< standard deviation of the part that is new at every row
  double wander = 0;    ///< standard deviation of the part that wanders
  double memory_s = 1;  ///< its correlation time
};

/// One error component: columns of the Jacobian, then the residual, as rows in order of time.
struct SerialRows {
  std::vector<double> t_s;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows;
};

/// What generalised least squares needs of some rows.
struct NormalSums {
  Eigen::MatrixXd A;  ///< J^T V^-1 J
  Eigen::VectorXd b;  ///< J^T V^-1 r
  double c = 0;       ///< r^T V^-1 r
  double log_det_V = 0;
  std::vector<double> innovations;  ///< whitened residuals, only where asked for

  NormalSums& operator+=(const NormalSums& other);
};

NormalSums whitened_sums(const SerialNoise& noise, const SerialRows& rows, bool keep_innovations = false);

/// The same apart for every stretch of `block_s`, whose innovations are independent of one another's where the noise is as
/// modelled.
std::vector<NormalSums> whitened_blocks(const SerialNoise& noise, const SerialRows& rows, double block_s);

/// The wandering part of a series, smoothed over all of it.
std::vector<double> wandering_part(const SerialNoise& noise, const std::vector<double>& t_s, const Eigen::VectorXd& series);

/// Twice the negative logarithm of the restricted likelihood, up to a constant: what the unknowns explain is not counted as
/// evidence for small noise.
double restricted_cost(const NormalSums& sums);

/// The noise of the components `own`, which share one, that is the most likely where the rest of the problem is `others`.
/// Memory is sought between the median interval and `longest_memory_s`.
SerialNoise fit_serial_noise(const SerialNoise& start, const std::vector<const SerialRows*>& own, const NormalSums& others,
                             double longest_memory_s);

}  // namespace fbvins
