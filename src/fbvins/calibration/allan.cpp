// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/allan.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace fbvins {
namespace {

constexpr double kFewestFreedom = 2;
constexpr double kShortest_s = 0.08;  // below, a sensor's filter and quantisation show
constexpr double kDrop = 1.92;        // of the log-likelihood at a 95 % bound
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

/// Log-likelihood of variances, each as a chi-square with its degrees of freedom (N4); arguments: ln N, K.
class NoiseLikelihood {
 public:
  explicit NoiseLikelihood(const std::vector<AllanVariance>& all) {
    for (const AllanVariance& v : all)
      if (v.tau_s >= kShortest_s || all.size() < 4) used_.push_back(v);
    if (used_.size() < 3) used_ = all;
    // Scales of the search: white noise alone at the first point, random walk alone at the last.
    log_density_ = 0.5 * std::log(used_.front().variance * used_.front().tau_s);
    log_walk_ = 0.5 * std::log(3 * used_.back().variance / used_.back().tau_s);
  }

  double at(double log_density, double log_walk) const {
    const double n2 = std::exp(2 * log_density), k2 = std::exp(2 * log_walk);
    double sum = 0;
    for (const AllanVariance& v : used_) {
      const double expected = n2 / v.tau_s + k2 * v.tau_s / 3;  // (N2)
      sum -= 0.5 * v.freedom * (std::log(expected / v.variance) + v.variance / expected - 1);
    }
    return sum;
  }
  double best_density(double log_walk) const {
    return maximise([&](double x) { return at(x, log_walk); }, log_density_ - 3, log_density_ + 1);
  }
  double best_walk(double log_density) const {
    return maximise([&](double x) { return at(log_density, x); }, none(), log_walk_ + 2);
  }
  double by_walk(double log_walk) const { return at(best_density(log_walk), log_walk); }
  double by_density(double log_density) const { return at(log_density, best_walk(log_density)); }
  double none() const { return log_walk_ - 8; }  ///< as good as no random walk
  double most() const { return log_walk_ + 2; }
  double log_density() const { return log_density_; }
  const std::vector<AllanVariance>& used() const { return used_; }

 private:
  std::vector<AllanVariance> used_;
  double log_density_, log_walk_;
};

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

AxisNoise fit_noise(const std::vector<AllanVariance>& variances) {
  AxisNoise out;
  const NoiseLikelihood likelihood(variances);
  const double walk = maximise([&](double x) { return likelihood.by_walk(x); }, likelihood.none(), likelihood.most());
  const double density = likelihood.best_density(walk);
  const double top = std::max(likelihood.at(density, walk), likelihood.by_walk(likelihood.none()));
  const auto by_walk = [&](double x) { return likelihood.by_walk(x); };
  const auto by_density = [&](double x) { return likelihood.by_density(x); };
  out.random_walk.value = std::exp(walk);
  out.random_walk.high = std::exp(crossing(by_walk, top - kDrop, walk, likelihood.most()));
  const double low = crossing(by_walk, top - kDrop, walk, likelihood.none());
  out.random_walk.low = low <= likelihood.none() ? 0 : std::exp(low);
  out.density.value = std::exp(density);
  out.density.low = std::exp(crossing(by_density, top - kDrop, density, likelihood.log_density() - 3));
  out.density.high = std::exp(crossing(by_density, top - kDrop, density, likelihood.log_density() + 1));
  for (const AllanVariance& v : likelihood.used()) {
    const double expected = std::exp(2 * density) / v.tau_s + std::exp(2 * walk) * v.tau_s / 3;
    const double off = (v.variance / expected - 1) * std::sqrt(v.freedom / 2);
    out.misfit += off * off / static_cast<double>(likelihood.used().size());
  }
  return out;
}

}  // namespace fbvins
