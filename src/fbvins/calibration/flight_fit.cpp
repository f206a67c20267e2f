// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/flight_fit.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

constexpr int kMaxIterations = 25;
/// Damping, which in directions that are not determined must not pass for information.
constexpr double kLeastDamping = 1e-10;
/// Decrease of the cost, in units of half a squared standard deviation, with which a fit has converged.
constexpr double kConverged = 0.1;
/// The noise of readings is looked for within so many halvings and doublings.
constexpr int kMostHalvings = 5;
/// Standard deviation over the median of absolute values, of a normal distribution.
constexpr double kSigmaOverMedian = 1.4826;
constexpr double kLeastSigma_px = 0.05;

double total_cost(const FlightPieces& pieces, const FlightRig& rig) {
  double sum = 0;
  for (const FlightPiece* piece : pieces) sum += piece->cost(rig);
  return sum;
}

CalibrationEquations all_of(const FlightPieces& pieces, const FlightRig& rig, double lambda) {
  CalibrationEquations sum;
  for (FlightPiece* piece : pieces) {
    const CalibrationEquations e = piece->linearise(rig, lambda);
    if (sum.gradient.size() == 0) sum.gradient = Eigen::VectorXd::Zero(e.gradient.size());
    if (sum.information.size() == 0) sum.information = Eigen::MatrixXd::Zero(e.gradient.size(), e.gradient.size());
    sum.cost += e.cost, sum.gradient += e.gradient, sum.information += e.information;
  }
  return sum;
}

/// The step of the free parameters; zero of the others.
Eigen::VectorXd free_step(const Eigen::MatrixXd& information, const Eigen::VectorXd& gradient, const std::vector<bool>& free) {
  std::vector<Eigen::Index> at;
  for (std::size_t i = 0; i < free.size(); ++i)
    if (free[i]) at.push_back(static_cast<Eigen::Index>(i));
  Eigen::VectorXd step = Eigen::VectorXd::Zero(gradient.size());
  if (at.empty()) return step;
  const Eigen::VectorXd scale = information(at, at).diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information(at, at) * scale.asDiagonal();
  step(at) = -scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(gradient(at))));
  return step;
}

}  // namespace

Eigen::VectorXd prior_information(const FlightRig& given) {
  const std::vector<FlightParameter> parameters = flight_parameters(given);
  Eigen::VectorXd out(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i)
    out[static_cast<Eigen::Index>(i)] = 1 / (parameters[i].prior_sigma * parameters[i].prior_sigma);
  return out;
}

FlightFit fit_calibration(const FlightPieces& pieces, const FlightRig& given, const FlightRig& start,
                          const std::vector<bool>& free, const FlightNoise& noise) {
  for (FlightPiece* piece : pieces) piece->set_noise(noise);
  const Eigen::VectorXd prior = prior_information(given);
  FlightFit fit;
  fit.rig = start;
  double lambda = 1e-8;
  bool converged = false;
  while (!converged && fit.iterations < kMaxIterations) {
    const CalibrationEquations e = all_of(pieces, fit.rig, lambda);
    const Eigen::VectorXd off = step_between(given, fit.rig);
    const Eigen::MatrixXd information = e.information / noise.spread;
    Eigen::MatrixXd with_prior = information;
    with_prior.diagonal() += prior;
    const Eigen::VectorXd gradient = e.gradient / noise.spread + prior.cwiseProduct(off);
    const double before = e.cost / noise.spread + 0.5 * off.dot(prior.cwiseProduct(off));
    const Eigen::VectorXd step = free_step(with_prior, gradient, free);
    for (FlightPiece* piece : pieces) piece->move(step);
    const FlightRig next = moved(fit.rig, step);
    const Eigen::VectorXd off_next = step_between(given, next);
    const double cost = total_cost(pieces, next);
    const double after = cost / noise.spread + 0.5 * off_next.dot(prior.cwiseProduct(off_next));
    ++fit.iterations;
    if (after <= before) {
      fit.rig = next, fit.cost = cost;
      converged = before - after < kConverged;
      lambda = std::max(0.1 * lambda, kLeastDamping);
    } else {
      for (FlightPiece* piece : pieces) piece->undo();
      fit.cost = e.cost;
      converged = lambda > 1e3;
      lambda = std::max(10 * lambda, 1e-4);
    }
  }
  if (std::find(free.begin(), free.end(), true) != free.end())
    fit.information = all_of(pieces, fit.rig, kLeastDamping).information / noise.spread;
  return fit;
}

double settled_cost(const FlightPieces& pieces, const FlightRig& rig, const FlightNoise& noise) {
  const std::vector<bool> none(static_cast<std::size_t>(values(rig).size()), false);
  FlightNoise alone = noise;  // without a calibration that is fitted there is nothing to spread
  alone.spread = 1;
  double sum = 0;
  for (FlightPiece* piece : pieces) sum += fit_calibration({piece}, rig, rig, none, alone).cost;
  return sum;
}

namespace {

double unlikelihood(const FlightPieces& pieces, const FlightRig& rig, const FlightNoise& noise) {
  (void)settled_cost(pieces, rig, noise);
  double sum = 0;
  for (FlightPiece* piece : pieces) {
    (void)piece->linearise(rig, kLeastDamping);
    sum += piece->unlikelihood();
  }
  return sum;
}

/// The power of two of `factor`, and where between powers a parabola has its minimum.
void find_factor(const FlightPieces& pieces, const FlightRig& rig, double FlightNoise::*factor, FlightNoise& noise) {
  std::map<int, double> cost;
  const auto at = [&](int power) {
    const auto [it, is_new] = cost.try_emplace(power, 0);
    if (!is_new) return it->second;
    FlightNoise tried = noise;
    tried.*factor = std::exp2(power);
    return it->second = unlikelihood(pieces, rig, tried);
  };
  int best = 0;
  for (const int step : {-1, 1})
    while (std::abs(best + step) <= kMostHalvings && at(best + step) < at(best)) best += step;
  const double before = at(best - 1), here = at(best), after = at(best + 1), bend = before - 2 * here + after;
  noise.*factor = std::exp2(best + (bend > 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0));
}

}  // namespace

FlightNoise with_noise_of_readings(const FlightPieces& pieces, const FlightRig& rig, const FlightNoise& noise) {
  FlightNoise out = noise;
  find_factor(pieces, rig, &FlightNoise::accel, out);
  find_factor(pieces, rig, &FlightNoise::gyro, out);
  return out;
}

double sigma_px_of(const FlightPieces& pieces, const FlightRig& rig) {
  std::vector<double> sizes;
  double points = 0;
  for (const FlightPiece* piece : pieces) {
    for (const double r : piece->residuals_px(rig)) sizes.push_back(std::abs(r));
    points += piece->points();
  }
  const double count = static_cast<double>(sizes.size());
  const double degrees = std::max(count - 3 * points, 0.25 * count);
  return std::max(kSigmaOverMedian * median(sizes) * std::sqrt(count / std::max(degrees, 1.0)), kLeastSigma_px);
}

double spread_of(const FlightPieces& pieces, const FlightFit& fit, const FlightNoise& noise) {
  if (pieces.size() < 2) return 1;
  std::vector<Eigen::VectorXd> gradients;
  Eigen::MatrixXd information;
  for (FlightPiece* piece : pieces) {
    piece->set_noise(noise);
    const CalibrationEquations e = piece->linearise(fit.rig, kLeastDamping);
    gradients.push_back(e.gradient);
    if (information.size() == 0) information = Eigen::MatrixXd::Zero(e.gradient.size(), e.gradient.size());
    information += e.information;
  }
  const Eigen::VectorXd prior = prior_information(fit.rig);
  Eigen::MatrixXd all = information;
  all.diagonal() += prior;
  const Eigen::VectorXd scale = all.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> factor(Eigen::MatrixXd(scale.asDiagonal() * all * scale.asDiagonal()));
  double seen = 0;
  for (const Eigen::VectorXd& g : gradients) {
    const Eigen::VectorXd scaled = scale.cwiseProduct(g);
    seen += scaled.dot(factor.solve(scaled));
  }
  const double expected = factor.solve(Eigen::MatrixXd(scale.asDiagonal() * information * scale.asDiagonal())).trace();
  const double count = static_cast<double>(pieces.size());
  return std::max(1.0, count / (count - 1) * seen / std::max(expected, 1e-9));
}

}  // namespace fbvins
