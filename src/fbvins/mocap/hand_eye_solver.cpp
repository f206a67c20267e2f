// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/hand_eye_solver.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace fbvins {

using namespace hand_eye;

namespace {

constexpr double kOutlier_sigmas = 5;
constexpr int kRounds = 4, kSteps = 8;
constexpr double kBlock_s = 6;  // length of the stretches of flight that are compared with one another
// Information of weak priors that hold unobservable directions: standard deviations of 10 m, 3 rad and 10 s.
constexpr double kLoosePosition = 1e-2, kLooseRotation = 0.1, kLooseClock = 1e-2;
// Priors of a stereo odometry's own errors: a scale to 1 %, and any share of its heading's drift in the path.
constexpr double kScaleInformation = 1e4, kBendInformation = 1;

// Which noise each of the six components of a residual has.
constexpr std::array<std::size_t, 6> kGroup = {0, 0, 1, 2, 2, 3};

using Full = Eigen::Matrix<double, kHandEyeUnknowns, 1>;

std::vector<int> unknowns_of(const HandEyeOptions& options) {
  std::vector<int> unknowns;
  for (int i = 0; i < kHandEyeUnknowns; ++i) {
    const bool levelled = options.level_world && (i == kTurnVW || i == kTurnVW + 1);
    if (!levelled && (i != kDrift || options.clock_drift)) unknowns.push_back(i);
  }
  return unknowns;
}

Full loose_information() {
  Full out;
  out << Vec3::Constant(kLoosePosition), Vec3::Constant(kLooseRotation), Vec3::Constant(kLoosePosition),
      Vec3::Constant(kLooseRotation), kLooseClock, kLooseClock, kScaleInformation, kBendInformation;
  return out;
}

void move(MarkerCalibration& c, const Full& step) {
  c.T_BK = c.T_BK.boxplus(step.segment<3>(kLever), step.segment<3>(kTurnBK));
  c.T_VW = c.T_VW.boxplus(c.T_VW.q * Vec3(step.segment<3>(kShiftVW)), step.segment<3>(kTurnVW));
  c.drift += step(kDrift);
  c.offset = c.offset + Duration::from_seconds(step(kOffset));
}

/// d residual / d unknowns, but for those of the estimate's own errors.
Eigen::Matrix<double, 6, kHandEyeUnknowns> jacobian_of(const HandEyePair& pair, const MarkerCalibration& c) {
  const Mat3 R_WV = c.T_VW.R().transpose(), R_WB = pair.T_WB.R(), R_WK = R_WB * c.T_BK.R();
  const double since_s = (c.to_marker(pair.t) - c.reference).seconds();
  Eigen::Matrix<double, 6, kHandEyeUnknowns> J = Eigen::Matrix<double, 6, kHandEyeUnknowns>::Zero();
  J.block<3, 3>(0, kLever) = -R_WB;
  J.block<3, 3>(0, kShiftVW) = -Mat3::Identity();
  J.block<3, 3>(0, kTurnVW) = hat(R_WV * (pair.T_VK.p - c.T_VW.p));
  J.block<3, 1>(0, kOffset) = -(pair.v_WB + R_WB * pair.w_WB_B.cross(c.T_BK.p));
  J.block<3, 3>(3, kTurnBK) = -R_WK;
  J.block<3, 3>(3, kTurnVW) = -Mat3::Identity();
  J.block<3, 1>(3, kOffset) = -(R_WB * pair.w_WB_B);
  J.col(kDrift) = since_s * J.col(kOffset);
  return J;
}

}  // namespace

HandEyeSolver::HandEyeSolver(const MarkerCurve& curve, Trajectory<W> estimate, MarkerCalibration start,
                             const HandEyeOptions& options)
    : curve_(curve), estimate_(std::move(estimate)), c_(start), unknowns_(unknowns_of(options)) {
  noise_ = {SerialNoise{0.002, 0.01, 10}, SerialNoise{0.002, 0.01, 10}, SerialNoise{0.004, 0.004, 10},
            SerialNoise{0.004, 0.01, 10}};
}

void HandEyeSolver::run() {
  for (int round = 0; round < kRounds; ++round) {
    step_until_still();
    fit_noise();
    if (round + 1 < kRounds) drop_outliers();
  }
  step_until_still();
}

HandEye HandEyeSolver::result() const {
  HandEye out;
  out.calibration = c_;
  out.noise = noise_;
  out.pairs = pairs_;
  out.outliers = outliers_;
  out.scale = 1 / (1 + scale_);
  const Rows all = rows();
  const NormalSums sums = with_loose(sum_all(all));
  out.disagreement = disagreement(all);
  const Eigen::MatrixXd covariance =
      out.disagreement * sums.A.ldlt().solve(Eigen::MatrixXd::Identity(sums.A.rows(), sums.A.cols()));
  for (std::size_t i = 0; i < unknowns_.size(); ++i)
    for (std::size_t k = 0; k < unknowns_.size(); ++k)
      out.covariance(unknowns_[i], unknowns_[k]) = covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
  return out;
}

HandEyeSolver::Rows HandEyeSolver::rows() const {
  const std::vector<HandEyePair> pairs = pair_up(curve_, estimate_, c_);
  const auto columns = static_cast<Eigen::Index>(unknowns_.size());
  const std::vector<Vec3> bends = bends_of(pairs);
  Rows out;
  for (SerialRows& component : out) component.rows.resize(static_cast<Eigen::Index>(pairs.size()), columns + 1);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vec3 from_start = pairs[i].T_WB.p - pairs.front().T_WB.p;
    Vec6 r = residual_of(pairs[i], c_);
    r.head<3>() -= scale_ * from_start + bend_ * bends[i];
    auto J = jacobian_of(pairs[i], c_);
    J.block<3, 1>(0, kScale) = -from_start;
    J.block<3, 1>(0, kBend) = -bends[i];
    for (int k = 0; k < 6; ++k) {
      SerialRows& component = out[static_cast<std::size_t>(k)];
      const auto row = static_cast<Eigen::Index>(i);
      component.t_s.push_back((pairs[i].t - estimate_.front().t).seconds());
      for (Eigen::Index u = 0; u < columns; ++u) component.rows(row, u) = J(k, unknowns_[static_cast<std::size_t>(u)]);
      component.rows(row, columns) = r(k);
    }
  }
  return out;
}

/// How a drifting heading bends the path that is built on it: the integral of (heading's error x motion).
std::vector<Vec3> HandEyeSolver::bends_of(const std::vector<HandEyePair>& pairs) const {
  std::vector<Vec3> bends(pairs.size(), Vec3::Zero());
  if (pairs.empty()) return bends;
  std::vector<double> t_s;
  Eigen::VectorXd headings(static_cast<Eigen::Index>(pairs.size()));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    t_s.push_back((pairs[i].t - pairs.front().t).seconds());
    headings(static_cast<Eigen::Index>(i)) = residual_of(pairs[i], c_)(5);
  }
  const std::vector<double> heading = wandering_part(noise_[kGroup[5]], t_s, headings);
  for (std::size_t i = 1; i < pairs.size(); ++i)
    bends[i] = bends[i - 1] + 0.5 * (heading[i] + heading[i - 1]) * Vec3::UnitZ().cross(pairs[i].T_WB.p - pairs[i - 1].T_WB.p);
  return bends;
}

NormalSums HandEyeSolver::sum_all(const Rows& rows) const {
  NormalSums sums;
  for (std::size_t k = 0; k < 6; ++k) sums += whitened_sums(noise_[kGroup[k]], rows[k]);
  return sums;
}

/// Adds the priors: the estimate's own errors are small; those of all else only hold unobservable directions.
NormalSums HandEyeSolver::with_loose(NormalSums sums) const {
  const Full information = loose_information();
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double value = unknowns_[i] == kScale ? scale_ : unknowns_[i] == kBend ? bend_ : 0;
    sums.A(at, at) += information(unknowns_[i]);
    sums.b(at) += information(unknowns_[i]) * value;
  }
  return sums;
}

/// Variance between the stretches of the flight over that which the noise explains, at least 1: errors of the estimate that
/// depend on the motion are neither white nor do they wander. Under the model a stretch's gradient has its own A as covariance.
double HandEyeSolver::disagreement(const Rows& all) const {
  std::vector<NormalSums> blocks;
  for (std::size_t k = 0; k < 6; ++k) {
    const std::vector<NormalSums> parts = whitened_blocks(noise_[kGroup[k]], all[k], kBlock_s);
    blocks.resize(std::max(blocks.size(), parts.size()));
    for (std::size_t i = 0; i < parts.size(); ++i) blocks[i] += parts[i];
  }
  double sum = 0;
  for (NormalSums& block : blocks) {
    block.A.diagonal().array() += 1e-9;
    sum += block.b.dot(block.A.ldlt().solve(block.b));
  }
  const double unknowns = static_cast<double>(unknowns_.size()), free = unknowns * (static_cast<double>(blocks.size()) - 1);
  return free > 0 ? std::max(1.0, sum / free) : 1;
}

void HandEyeSolver::step_until_still() {
  for (int i = 0; i < kSteps; ++i) {
    const NormalSums sums = with_loose(sum_all(rows()));
    const Eigen::VectorXd x = -sums.A.ldlt().solve(sums.b);
    if (!x.allFinite()) return;
    Full step = Full::Zero();
    for (std::size_t k = 0; k < unknowns_.size(); ++k) step(unknowns_[k]) = x(static_cast<Eigen::Index>(k));
    step *= std::min(1.0, 0.5 / step.segment<12>(0).cwiseAbs().maxCoeff());  // half a metre or radian at a time
    move(c_, step);
    scale_ += step(kScale);
    bend_ += step(kBend);
    if (x.dot(sums.A * x) < 1e-6) return;  // a thousandth of a sigma
  }
}

void HandEyeSolver::fit_noise() {
  const Rows all = rows();
  const double longest_s = 2 * (estimate_.back().t - estimate_.front().t).seconds();
  for (std::size_t group = 0; group < noise_.size(); ++group) {
    std::vector<const SerialRows*> own;
    NormalSums others;
    for (std::size_t k = 0; k < 6; ++k) {
      if (kGroup[k] == group) own.push_back(&all[k]);
      else others += whitened_sums(noise_[kGroup[k]], all[k]);
    }
    noise_[group] = fit_serial_noise(noise_[group], own, with_loose(std::move(others)), longest_s);
  }
}

/// Drops poses of the estimate of which the innovation of a component exceeds kOutlier_sigmas. The noise was fitted with them
/// in it, so that in one round they are few, and the others after them in the next rounds.
void HandEyeSolver::drop_outliers() {
  const Rows all = rows();
  std::vector<bool> bad(all[0].t_s.size(), false);
  for (std::size_t k = 0; k < 6; ++k) {
    const NormalSums sums = whitened_sums(noise_[kGroup[k]], all[k], true);
    for (std::size_t i = 0; i < bad.size(); ++i)
      if (std::abs(sums.innovations[i]) > kOutlier_sigmas) bad[i] = true;
  }
  std::vector<Time> dropped;
  const std::vector<HandEyePair> pairs = pair_up(curve_, estimate_, c_);
  for (std::size_t i = 0; i < bad.size(); ++i)
    if (bad[i]) dropped.push_back(pairs[i].t);
  std::erase_if(estimate_,
                [&](const StampedPose<W>& pose) { return std::binary_search(dropped.begin(), dropped.end(), pose.t); });
  outliers_ += static_cast<int>(dropped.size());
  pairs_ = static_cast<int>(pairs.size() - dropped.size());
}

}  // namespace fbvins
