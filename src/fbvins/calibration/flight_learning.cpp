// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/flight_learning.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace fbvins {
namespace {

/// A parameter counts as determined where its standard deviation is at most this part of the prior's.
constexpr double kDetermined = 0.5;
/// Chance with which a group of parameters that is right is taken to be wrong: 0.5 %, nearly (Wilson, Hilferty).
constexpr double kNormalQuantile = 2.576;

double largest_by_chance(double count) {
  const double a = 2 / (9 * count), root = 1 - a + kNormalQuantile * std::sqrt(a);
  return count * root * root * root;
}

Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& information, const Eigen::VectorXd& prior,
                              const std::vector<Eigen::Index>& at) {
  Eigen::MatrixXd all = information(at, at);
  all.diagonal() += prior(at);
  const Eigen::VectorXd scale = all.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * all * scale.asDiagonal();
  const auto n = static_cast<Eigen::Index>(at.size());
  return scale.asDiagonal() * scaled.ldlt().solve(Eigen::MatrixXd::Identity(n, n)) * scale.asDiagonal();
}

/// The parameters of a group of one camera, among those that are free.
using Group = std::pair<FlightGroup, int>;

class Choice {
 public:
  Choice(const FlightRig& given, const FlightSurvey& survey, const FlightQuestion& question)
      : parameters_(flight_parameters(given)),
        prior_(prior_information(given)),
        information_(survey.fit.information / survey.noise.spread),
        matters_(question.matters) {
    for (std::size_t i = 0; i < parameters_.size(); ++i) all_.push_back(static_cast<Eigen::Index>(i));
    covariance_ = covariance_of(information_, prior_, all_);
    // The quadratic's gradient at `given`, from its minimum; from it follow the minima of fewer free parameters.
    const Eigen::VectorXd off = step_between(given, survey.fit.rig);
    pull_ = information_ * off + prior_.cwiseProduct(off) / survey.noise.spread;
    findings_.assign(parameters_.size(), FlightFinding::refined);
    const auto left = [&](std::size_t i) {
      return std::ranges::find(question.left, parameters_[i].group) != question.left.end();
    };
    if (question.rough) know([&](std::size_t i) { return left(i); });
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      if (std::sqrt(std::max(0.0, covariance_(k, k))) > kDetermined * parameters_[i].prior_sigma)
        findings_[i] = FlightFinding::not_determined;
      else if (left(i)) findings_[i] = FlightFinding::left;
    }
    while (!question.rough && drop_one()) {
    }
  }

  /// Of the other parameters the covariance is what it is with these as given.
  template <class Known>
  void know(const Known& known) {
    std::vector<Eigen::Index> unknown;
    for (const Eigen::Index k : all_)
      if (!known(static_cast<std::size_t>(k))) unknown.push_back(k);
    covariance_(unknown, unknown) = covariance_of(information_, prior_, unknown);
  }

  const std::vector<FlightFinding>& findings() const { return findings_; }
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  /// Free in the last fit: what is refined, and the IMU's axes, that they excuse no other parameter.
  std::vector<bool> free() const {
    std::vector<bool> out;
    for (std::size_t i = 0; i < parameters_.size(); ++i)
      out.push_back(findings_[i] == FlightFinding::refined || is_axis(parameters_[i].group));
    return out;
  }
  bool changed() const {
    for (std::size_t i = 0; i < parameters_.size(); ++i)
      if (findings_[i] == FlightFinding::refined) return true;
    return false;
  }

 private:
  /// Takes the group that differs least from what was given as confirmed, if chance explains it.
  bool drop_one() {
    const std::vector<bool> is_free = free();
    std::vector<Eigen::Index> at;
    for (std::size_t i = 0; i < is_free.size(); ++i)
      if (is_free[i]) at.push_back(static_cast<Eigen::Index>(i));
    if (at.empty()) return false;
    const Eigen::MatrixXd P = covariance_of(information_, prior_, at);
    const Eigen::VectorXd off = P * pull_(at);
    std::map<Group, std::vector<Eigen::Index>> groups;
    for (std::size_t k = 0; k < at.size(); ++k)
      if (const auto i = static_cast<std::size_t>(at[k]); findings_[i] == FlightFinding::refined)
        groups[{parameters_[i].group, parameters_[i].camera}].push_back(static_cast<Eigen::Index>(k));
    double least = 1;
    const std::vector<Eigen::Index>* dropped = nullptr;
    for (const auto& [group, members] : groups) {
      const Eigen::VectorXd d = off(members);
      const double by_chance =
          d.dot(Eigen::MatrixXd(P(members, members)).ldlt().solve(d)) / largest_by_chance(static_cast<double>(members.size()));
      double size = by_chance, largest = 0;
      for (std::size_t n = 0; n < members.size(); ++n)
        largest =
            std::max(largest, std::abs(d[static_cast<Eigen::Index>(n)]) /
                                  parameters_[static_cast<std::size_t>(at[static_cast<std::size_t>(members[n])])].prior_sigma);
      size = std::min(size, largest * largest / (matters_ * matters_));
      if (size < least) least = size, dropped = &members;
    }
    if (dropped == nullptr) return false;
    for (const Eigen::Index k : *dropped)
      findings_[static_cast<std::size_t>(at[static_cast<std::size_t>(k)])] = FlightFinding::confirmed;
    return true;
  }

  std::vector<FlightParameter> parameters_;
  Eigen::VectorXd prior_;
  Eigen::MatrixXd information_, covariance_;
  double matters_;
  std::vector<Eigen::Index> all_;
  Eigen::VectorXd pull_;
  std::vector<FlightFinding> findings_;
};

}  // namespace

FlightSurvey survey_of(const FlightPieces& pieces, const FlightRig& given) {
  FlightSurvey out;
  const std::vector<bool> all(static_cast<std::size_t>(values(given).size()), true);
  (void)settled_cost(pieces, given, out.noise);
  out.noise.sigma_px = sigma_px_of(pieces, given);
  out.fit = fit_calibration(pieces, given, given, all, out.noise);
  out.noise.sigma_px = sigma_px_of(pieces, out.fit.rig);
  out.noise = with_noise_of_readings(pieces, out.fit.rig, out.noise);
  out.fit = fit_calibration(pieces, given, out.fit.rig, all, out.noise);
  out.noise.spread = spread_of(pieces, out.fit, out.noise);
  return out;
}

FlightLesson learn_from(const FlightPieces& pieces, const FlightRig& given, const FlightSurvey& survey,
                        const FlightQuestion& question) {
  const Choice choice(given, survey, question);
  FlightLesson out{given, survey.noise, choice.findings(), choice.covariance(), choice.changed()};
  // From what was given: what is not free stays so exactly.
  out.rig = fit_calibration(pieces, given, given, choice.free(), survey.noise).rig;
  return out;
}

}  // namespace fbvins
