// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/serial_noise.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace fbvins {
namespace {

// Lower bounds of the standard deviations, m or rad.
constexpr double kSmallestWhite = 2e-5, kSmallest = 1e-9;

/// log white, log wander, log memory.
using Point = Eigen::Vector3d;

SerialNoise noise_of(const Point& p, double longest_memory_s) {
  return {std::exp(std::max(p(0), std::log(kSmallestWhite))), std::exp(std::max(p(1), std::log(kSmallest))),
          std::exp(std::min(p(2), std::log(longest_memory_s)))};
}

/// Nelder and Mead's simplex with their coefficients, a fixed number of steps.
template <class Cost>
Point minimise_simplex(const Point& start, Cost&& cost) {
  constexpr int kSteps = 90;
  constexpr double kSpread = 0.7;
  struct Vertex {
    Point x;
    double f;
  };
  std::array<Vertex, 4> s;
  for (int i = 0; i < 4; ++i) {
    Point x = start;
    if (i > 0) x(i - 1) += kSpread;
    s[static_cast<std::size_t>(i)] = {x, cost(x)};
  }
  const auto better = [](const Vertex& a, const Vertex& b) { return a.f < b.f; };
  for (int step = 0; step < kSteps; ++step) {
    std::stable_sort(s.begin(), s.end(), better);
    const Point centre = (s[0].x + s[1].x + s[2].x) / 3;
    const auto along = [&](double k) {
      const Point x = centre + k * (s[3].x - centre);
      return Vertex{x, cost(x)};
    };
    Vertex trial = along(-1);
    if (trial.f < s[0].f) {
      const Vertex further = along(-2);
      s[3] = further.f < trial.f ? further : trial;
    } else if (trial.f < s[2].f) {
      s[3] = trial;
    } else {
      trial = trial.f < s[3].f ? along(-0.5) : along(0.5);
      if (trial.f < s[3].f) {
        s[3] = trial;
      } else {
        for (std::size_t i = 1; i < 4; ++i) {
          s[i].x = 0.5 * (s[i].x + s[0].x);
          s[i].f = cost(s[i].x);
        }
      }
    }
  }
  return std::min_element(s.begin(), s.end(), better)->x;
}

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Innovations of every column over their standard deviation, and the logarithm of V's determinant.
std::pair<RowMajor, double> whiten(const SerialNoise& noise, const SerialRows& rows) {
  const double white = noise.white * noise.white, wander = noise.wander * noise.wander;
  Eigen::RowVectorXd state = Eigen::RowVectorXd::Zero(rows.rows.cols());
  RowMajor whitened(rows.rows.rows(), rows.rows.cols());
  double variance = wander, log_det = 0;
  for (Eigen::Index i = 0; i < rows.rows.rows(); ++i) {
    if (i > 0) {
      const double dt = rows.t_s[static_cast<std::size_t>(i)] - rows.t_s[static_cast<std::size_t>(i) - 1];
      const double left = std::exp(-dt / noise.memory_s);
      state *= left;
      variance = left * left * variance + wander * (1 - left * left);
    }
    const double total = variance + white;
    whitened.row(i) = rows.rows.row(i) - state;
    state += (variance / total) * whitened.row(i);
    whitened.row(i) /= std::sqrt(total);
    variance *= white / total;
    log_det += std::log(total);
  }
  return {std::move(whitened), log_det};
}

NormalSums sums_of(const RowMajor& whitened, Eigen::Index from, Eigen::Index end) {
  const Eigen::Index unknowns = whitened.cols() - 1;
  const auto block = whitened.middleRows(from, end - from);
  const Eigen::MatrixXd sums = block.transpose() * block;
  NormalSums out;
  out.A = sums.topLeftCorner(unknowns, unknowns);
  out.b = sums.topRightCorner(unknowns, 1);
  out.c = sums(unknowns, unknowns);
  return out;
}

}  // namespace

NormalSums& NormalSums::operator+=(const NormalSums& other) {
  if (A.size() == 0) return *this = other;
  A += other.A, b += other.b, c += other.c, log_det_V += other.log_det_V;
  return *this;
}

NormalSums whitened_sums(const SerialNoise& noise, const SerialRows& rows, bool keep_innovations) {
  const auto [whitened, log_det_V] = whiten(noise, rows);
  NormalSums out = sums_of(whitened, 0, whitened.rows());
  out.log_det_V = log_det_V;
  if (keep_innovations)
    for (Eigen::Index i = 0; i < whitened.rows(); ++i) out.innovations.push_back(whitened(i, whitened.cols() - 1));
  return out;
}

std::vector<NormalSums> whitened_blocks(const SerialNoise& noise, const SerialRows& rows, double block_s) {
  const RowMajor whitened = whiten(noise, rows).first;
  std::vector<NormalSums> out;
  for (Eigen::Index from = 0; from < whitened.rows();) {
    Eigen::Index end = from;
    const auto block = [&](Eigen::Index i) {
      return std::floor((rows.t_s[static_cast<std::size_t>(i)] - rows.t_s.front()) / block_s);
    };
    while (end < whitened.rows() && block(end) == block(from)) ++end;
    out.push_back(sums_of(whitened, from, end));
    from = end;
  }
  return out;
}

std::vector<double> wandering_part(const SerialNoise& noise, const std::vector<double>& t_s, const Eigen::VectorXd& series) {
  const double white = noise.white * noise.white, wander = noise.wander * noise.wander;
  const std::size_t n = t_s.size();
  std::vector<double> filtered(n), filtered_variance(n), predicted(n), predicted_variance(n), left(n, 0.0);
  double state = 0, variance = wander;
  for (std::size_t i = 0; i < n; ++i) {
    if (i > 0) left[i] = std::exp(-(t_s[i] - t_s[i - 1]) / noise.memory_s);
    if (i > 0) state *= left[i], variance = left[i] * left[i] * variance + wander * (1 - left[i] * left[i]);
    predicted[i] = state, predicted_variance[i] = variance;
    const double gain = variance / (variance + white);
    state += gain * (series(static_cast<Eigen::Index>(i)) - state);
    variance *= 1 - gain;
    filtered[i] = state, filtered_variance[i] = variance;
  }
  for (std::size_t i = n; i-- > 1;) {  // Rauch, Tung and Striebel's way back
    const double gain = predicted_variance[i] > 0 ? filtered_variance[i - 1] * left[i] / predicted_variance[i] : 0;
    filtered[i - 1] += gain * (filtered[i] - predicted[i]);
  }
  return filtered;
}

double restricted_cost(const NormalSums& sums) {
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(sums.A);
  const Eigen::VectorXd pivots = ldlt.vectorD();
  if (!(pivots.minCoeff() > 0)) return std::numeric_limits<double>::infinity();
  return sums.log_det_V + pivots.array().log().sum() + sums.c - sums.b.dot(ldlt.solve(sums.b));
}

SerialNoise fit_serial_noise(const SerialNoise& start, const std::vector<const SerialRows*>& own, const NormalSums& others,
                             double longest_memory_s) {
  const auto cost = [&](const Point& p) {
    NormalSums all = others;
    for (const SerialRows* rows : own) all += whitened_sums(noise_of(p, longest_memory_s), *rows);
    return restricted_cost(all);
  };
  const Point from(std::log(start.white), std::log(std::max(start.wander, kSmallest)), std::log(start.memory_s));
  return noise_of(minimise_simplex(from, cost), longest_memory_s);
}

}  // namespace fbvins
