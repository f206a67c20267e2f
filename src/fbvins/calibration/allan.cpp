// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/allan.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace fbvins {
namespace {

constexpr double kFewestFreedom = 2;
constexpr double kCluster_s = 0.08;  // shorter, a sensor's filter and quantisation show
constexpr double kDrop = 1.92;       // of the log-likelihood at a 95 % bound
constexpr double kSigmas = 1.96;

/// Degrees of freedom for white noise of the signal (N3).
double freedom_of(double readings, double m) {
  const double n = readings + 1;  // phase points
  return (3 * (n - 1) / (2 * m) - 2 * (n - 2) / n) * 4 * m * m / (4 * m * m + 5);
}

/// x in [low, high] where f is largest.
double maximise(const std::function<double(double)>& f, double low, double high) {
  constexpr double kGolden = 0.6180339887498949;
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double fa = f(a), fb = f(b);
  for (int i = 0; i < 60; ++i) {
    if (fa > fb) high = b, b = a, fb = fa, a = high - kGolden * (high - low), fa = f(a);
    else low = a, a = b, fa = fb, b = low + kGolden * (high - low), fb = f(b);
  }
  return 0.5 * (low + high);
}

/// Where f falls below `level` between a top and a far point; the far point where it does not.
double crossing(const std::function<double(double)>& f, double level, double top, double far) {
  if (f(far) > level) return far;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (top + far);
    (f(middle) > level ? top : far) = middle;
  }
  return 0.5 * (top + far);
}

/// Likelihood of means over clusters as white noise on a random walk (N4), by a Kalman filter for ratios of the two on a grid.
/// Arguments: ln N, ln K.
class NoiseLikelihood {
 public:
  NoiseLikelihood(const std::vector<double>& means, double span_s) : span_s_(span_s), count_(static_cast<double>(means.size())) {
    double square = 0;
    for (std::size_t i = 0; i + 1 < means.size(); ++i) square += 0.5 * std::pow(means[i + 1] - means[i], 2) / (count_ - 1);
    log_density_ = 0.5 * std::log(square * span_s);
    first_ = std::log(0.01 / (count_ * count_));
    for (int i = 0; first_ + (i - 1) * kGrid < std::log(kLargestRatio); ++i) filter(means, std::exp(first_ + i * kGrid));
  }

  double at(double log_density, double log_walk) const {
    const double x = std::clamp((2 * (log_walk + std::log(span_s_) - log_density) - first_) / kGrid, 0.0,
                                static_cast<double>(squares_.size()) - 1.001);
    const double log_variance = 2 * log_density - std::log(span_s_);
    return -0.5 * ((count_ - 1) * log_variance + between(logs_, x) + between(squares_, x) * std::exp(-log_variance));
  }
  double best_density(double log_walk) const {
    return maximise([&](double x) { return at(x, log_walk); }, least_density(), most_density());
  }
  double best_walk(double log_density) const {
    return maximise([&](double x) { return at(log_density, x); }, none(), most());
  }
  double by_walk(double log_walk) const { return at(best_density(log_walk), log_walk); }
  double by_density(double log_density) const { return at(log_density, best_walk(log_density)); }
  double none() const { return log_density_ - std::log(span_s_) + 0.5 * first_; }  ///< as good as no random walk
  double most() const { return log_density_ - std::log(span_s_) + 0.5 * std::log(kLargestRatio); }
  double least_density() const { return log_density_ - 3; }
  double most_density() const { return log_density_ + 1; }

 private:
  static constexpr double kGrid = 0.25, kLargestRatio = 100;

  void filter(const std::vector<double>& means, double ratio) {
    double estimate = means.front(), variance = 1, square = 0, log = 0;
    for (std::size_t i = 1; i < means.size(); ++i) {
      const double before = variance + ratio, expected = before + 1, off = means[i] - estimate;
      square += off * off / expected, log += std::log(expected);
      estimate += before / expected * off;
      variance = before / expected;
    }
    squares_.push_back(square), logs_.push_back(log);
  }
  /// Cubic between the grid's points, by their slopes.
  static double between(const std::vector<double>& grid, double x) {
    const auto i = static_cast<std::size_t>(x);
    const double u = x - static_cast<double>(i), a = grid[i], b = grid[i + 1];
    const double before = i > 0 ? 0.5 * (b - grid[i - 1]) : b - a, after = i + 2 < grid.size() ? 0.5 * (grid[i + 2] - a) : b - a;
    return a + u * (before + u * (3 * (b - a) - 2 * before - after + u * (before + after - 2 * (b - a))));
  }

  double span_s_, count_, log_density_ = 0, first_ = 0;
  std::vector<double> squares_, logs_;  ///< at ratios of the random walk's variance over a cluster to the white noise's
};

std::vector<double> means_of(const std::vector<double>& readings, std::size_t m) {
  std::vector<double> means;
  for (std::size_t i = 0; i + m <= readings.size(); i += m) {
    double sum = 0;
    for (std::size_t k = i; k < i + m; ++k) sum += readings[k];
    means.push_back(sum / static_cast<double>(m));
  }
  return means;
}

}  // namespace

std::vector<AllanVariance> allan_variances(const std::vector<double>& readings, double period_s) {
  std::vector<double> sum(readings.size() + 1, 0.0);
  double mean = 0;
  for (double x : readings) mean += x / static_cast<double>(readings.size());
  for (std::size_t i = 0; i < readings.size(); ++i) sum[i + 1] = sum[i] + (readings[i] - mean);
  std::vector<AllanVariance> out;
  for (std::size_t m = 1; 2 * m < readings.size(); m *= 2) {
    const double size = static_cast<double>(m), freedom = freedom_of(static_cast<double>(readings.size()), size);
    if (freedom < kFewestFreedom) break;
    double square = 0;
    const std::size_t count = readings.size() - 2 * m + 1;
    for (std::size_t i = 0; i < count; ++i) {
      const double d = (sum[i + 2 * m] - 2 * sum[i + m] + sum[i]) / size;
      square += d * d;
    }
    out.push_back({size * period_s, square / (2 * static_cast<double>(count)), freedom});  // (N1)
  }
  return out;
}

std::vector<AllanPoint> allan_deviation(const std::vector<double>& readings, double period_s) {
  std::vector<AllanPoint> curve;
  for (const AllanVariance& v : allan_variances(readings, period_s)) {
    // Wilson and Hilferty's approximation to the quantiles of chi-square.
    const double a = 2 / (9 * v.freedom);
    const auto bound = [&](double z) { return std::sqrt(v.variance / std::pow(std::max(0.02, 1 - a + z * std::sqrt(a)), 3)); };
    curve.push_back({v.tau_s, std::sqrt(v.variance), bound(kSigmas), bound(-kSigmas)});
  }
  return curve;
}

AxisNoise fit_noise(const std::vector<double>& readings, double period_s) {
  const auto m = static_cast<std::size_t>(std::max(1.0, std::round(kCluster_s / period_s)));
  const NoiseLikelihood likelihood(means_of(readings, m), period_s * static_cast<double>(m));
  const auto by_walk = [&](double x) { return likelihood.by_walk(x); };
  const auto by_density = [&](double x) { return likelihood.by_density(x); };
  const double walk = maximise(by_walk, likelihood.none(), likelihood.most()), density = likelihood.best_density(walk);
  const double level = likelihood.at(density, walk) - kDrop;  // (N5)
  AxisNoise out;
  out.random_walk.value = std::exp(walk);
  out.random_walk.high = std::exp(crossing(by_walk, level, walk, likelihood.most()));
  const double low = crossing(by_walk, level, walk, likelihood.none());
  out.random_walk.low = low <= likelihood.none() ? 0 : std::exp(low);
  out.density.value = std::exp(density);
  out.density.low = std::exp(crossing(by_density, level, density, likelihood.least_density()));
  out.density.high = std::exp(crossing(by_density, level, density, likelihood.most_density()));
  out.curve = allan_deviation(readings, period_s);
  const std::vector<AllanVariance> variances = allan_variances(readings, period_s);
  double points = 0;
  for (const AllanVariance& v : variances) {
    if (v.tau_s < kCluster_s) continue;
    const double expected = std::exp(2 * density) / v.tau_s + std::exp(2 * walk) * v.tau_s / 3;  // (N2)
    out.misfit += (v.variance / expected - 1) * (v.variance / expected - 1) * v.freedom / 2, points += 1;
  }
  out.misfit /= std::max(1.0, points);
  return out;
}

}  // namespace fbvins
