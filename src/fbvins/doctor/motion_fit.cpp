// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/motion_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "fbvins/doctor/block_fit.hpp"
#include "fbvins/doctor/lens_change.hpp"
#include "fbvins/frontend/median.hpp"
#include "fbvins/imu/propagation.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Unknowns: rotation (R_CB Exp(x), rad), time offset (s), gyroscope's bias (rad/s), logarithm of its scale, time from an image's
// first line to its last (s), and of the left lens logarithm of the focal length, principal point (px), radial coefficients.
enum : int {
  kRotation = 0,
  kTime = 3,
  kBias = 4,
  kScale = 7,
  kRolling = 8,
  kFocal = 9,
  kCentre = 10,
  kRadial = 12,
  kUnknowns = 14
};
constexpr std::array<double, kUnknowns> kPriorSigma{0.5, 0.5, 0.5, 0.2, 0.3, 0.3, 0.3, 0.3, 0.1, 0.3, 50, 50, 0.2, 0.2};
constexpr std::array<double, kUnknowns> kStep{1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-4, 1e-5, 1e-5, 1e-2, 1e-2, 1e-4, 1e-4};

struct Group {
  FindingKind kind;
  std::vector<int> unknowns;
  double practical;  ///< norm of the amount below which a change is not worth a word
};
const std::vector<Group>& groups() {
  static const std::vector<Group> all{
      {FindingKind::time_offset, {kTime}, 3e-3},
      {FindingKind::imu_camera_rotation, {kRotation, kRotation + 1, kRotation + 2}, 0.0175},
      {FindingKind::gyro_scale, {kScale}, 0.03},
      {FindingKind::rolling_shutter, {kRolling}, 4e-3},
      {FindingKind::focal_length, {kFocal}, 0.02},
      {FindingKind::principal_point, {kCentre, kCentre + 1}, 8},
      {FindingKind::distortion, {kRadial, kRadial + 1}, 0.05},
  };
  return all;
}
constexpr double kSignificant = 5;
constexpr int kRounds = 5, kIterations = 4;
constexpr double kCap_px = 3, kHuberSigmas = 2;
constexpr std::size_t kFeaturesOfAPair = 40, kFewestPairs = 30;

/// The start, moved by x, made once for all pairs.
struct Hypothesis {
  Camera camera;
  Mat3 R_CB;
  Duration offset;
  Vec3 bias;
  double scale, rolling_s;

  Hypothesis(const MotionStart& start, const VectorXd& x)
      : camera(changed(start.rig.left, {x(kFocal), {x(kCentre), x(kCentre + 1)}, {x(kRadial), x(kRadial + 1)}})),
        R_CB(start.rig.T_BC0.R().transpose() * so3_exp(Vec3(x.segment<3>(kRotation))).toRotationMatrix()),
        offset(Duration::from_seconds(start.offset_s + x(kTime))),
        bias(x.segment<3>(kBias)),
        scale(std::exp(x(kScale))),
        rolling_s(x(kRolling)) {}
};

/// A pair's turn as one hypothesis has it.
struct PredictedTurn {
  Mat3 R_ba;
  Vec3 rate_a, rate_b;  ///< in C, rad/s

  PredictedTurn(const Hypothesis& h, const FramePair& pair, const ImuSeries& imu) {
    const Time a = pair.a + h.offset, b = pair.b + h.offset;
    const Vec3 turn_B = h.scale * so3_log(integrate_gyro(imu.segment(a, b), h.bias));
    R_ba = so3_exp(-(h.R_CB * turn_B)).toRotationMatrix();
    rate_a = h.R_CB * (imu.at(a).gyro_radps - h.bias);
    rate_b = h.R_CB * (imu.at(b).gyro_radps - h.bias);
  }
};

Vec3 small_turn(const Vec3& theta, const Vec3& v) { return v + theta.cross(v); }

/// X_b = R_ba (x_a - rho p_CaCb), each image line at its own time.
std::optional<Vec2> residual(const Hypothesis& h, const PredictedTurn& turn, const PairedFeature& feature, const Vec2& ray_a,
                             const Vec3& p_ab) {
  const double height = h.camera.height();
  const double late_a = h.rolling_s * (feature.a_px.y() / height - 0.5), late_b = h.rolling_s * (feature.b_px.y() / height - 0.5);
  const Vec3 X_a = small_turn(late_a * turn.rate_a, ray_a.homogeneous()) - feature.inverse_depth * p_ab;
  const Vec3 X_b = small_turn(-late_b * turn.rate_b, turn.R_ba * X_a);
  if (X_b.z() < 0.05) return std::nullopt;
  return Vec2(h.camera.distort(X_b.hnormalized()) - feature.b_px);
}

struct Problem {
  std::vector<FramePair> pairs;  ///< with thinned features; p_CaCb follows the hypothesis
  const ImuSeries& imu;
  MotionStart start;

  /// The translation that fits best under a hypothesis, from where it was.
  void settle(const Hypothesis& h, FramePair& pair, double sigma) const;
  double typical_error(const Hypothesis& h) const;
  double capped_error(const Hypothesis& h) const;
  BlockFit linearise(const VectorXd& x, const std::vector<int>& free);
  std::optional<BlockSolution> converge(const std::vector<int>& free, VectorXd& x);
};

constexpr double kDifference_m = 1e-4;

void Problem::settle(const Hypothesis& h, FramePair& pair, double sigma) const {
  const PredictedTurn turn(h, pair, imu);
  for (int iteration = 0; iteration < 3; ++iteration) {
    Mat3 H = 1e-4 * static_cast<double>(pair.features.size()) * Mat3::Identity();
    Vec3 g = Vec3::Zero();
    for (const PairedFeature& feature : pair.features) {
      const auto ray = h.camera.undistort(feature.a_px);
      if (!ray) continue;
      const auto r = residual(h, turn, feature, *ray, pair.p_CaCb);
      if (!r) continue;
      Eigen::Matrix<double, 2, 3> J;
      bool whole = true;
      for (int i = 0; i < 3 && whole; ++i) {
        const auto moved = residual(h, turn, feature, *ray, pair.p_CaCb + kDifference_m * Vec3::Unit(i));
        whole = moved.has_value();
        if (whole) J.col(i) = (*moved - *r) / kDifference_m;
      }
      if (!whole) continue;
      const double weight = huber(r->squaredNorm(), kHuberSigmas * sigma).weight;
      H += weight * J.transpose() * J;
      g += weight * J.transpose() * *r;
    }
    const Vec3 step = -H.ldlt().solve(g);
    if (!step.allFinite()) return;
    pair.p_CaCb += step;
  }
}

template <class Take>
void for_each_residual(const Problem& problem, const Hypothesis& h, Take&& take) {
  for (const FramePair& pair : problem.pairs) {
    const PredictedTurn turn(h, pair, problem.imu);
    for (const PairedFeature& feature : pair.features) {
      const auto ray = h.camera.undistort(feature.a_px);
      const auto r = ray ? residual(h, turn, feature, *ray, pair.p_CaCb) : std::nullopt;
      take(r ? r->norm() : kCap_px);
    }
  }
}

double Problem::typical_error(const Hypothesis& h) const {
  std::vector<double> norms;
  for_each_residual(*this, h, [&](double norm) { norms.push_back(norm); });
  return 0.85 * median(norms);
}

double Problem::capped_error(const Hypothesis& h) const {
  double sum = 0;
  int count = 0;
  for_each_residual(*this, h, [&](double norm) {
    sum += std::pow(std::min(norm, kCap_px), 2);
    ++count;
  });
  return std::sqrt(sum / std::max(count, 1));
}

BlockFit Problem::linearise(const VectorXd& x, const std::vector<int>& free) {
  const Hypothesis at(start, x);
  std::vector<Hypothesis> moved;
  for (const int i : free) {
    VectorXd y = x;
    y(i) += kStep[static_cast<std::size_t>(i)];
    moved.emplace_back(start, y);
  }
  const double sigma = std::max(typical_error(at), 0.03);
  const auto n = static_cast<Eigen::Index>(free.size());
  BlockFit fit(Eigen::Map<const VectorXd>(kPriorSigma.data(), kUnknowns), sigma);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    FramePair& pair = pairs[k];
    settle(at, pair, sigma);
    const PredictedTurn turn(at, pair, imu);
    std::vector<PredictedTurn> turns;
    for (const Hypothesis& h : moved) turns.emplace_back(h, pair, imu);
    MatrixXd H = MatrixXd::Zero(n + 3, n + 3);
    VectorXd g = VectorXd::Zero(n + 3);
    for (const PairedFeature& feature : pair.features) {
      const auto ray = at.camera.undistort(feature.a_px);
      const auto r = ray ? residual(at, turn, feature, *ray, pair.p_CaCb) : std::nullopt;
      if (!r) continue;
      MatrixXd J(2, n + 3);
      bool whole = true;
      for (Eigen::Index i = 0; i < n && whole; ++i) {
        const auto f = static_cast<std::size_t>(i);
        const auto ray_there = free[f] >= kFocal ? moved[f].camera.undistort(feature.a_px) : ray;
        const auto there = ray_there ? residual(moved[f], turns[f], feature, *ray_there, pair.p_CaCb) : std::nullopt;
        whole = there.has_value();
        if (whole) J.col(i) = (*there - *r) / kStep[static_cast<std::size_t>(free[f])];
      }
      for (int i = 0; i < 3 && whole; ++i) {
        const auto there = residual(at, turn, feature, *ray, pair.p_CaCb + kDifference_m * Vec3::Unit(i));
        whole = there.has_value();
        if (whole) J.col(n + i) = (*there - *r) / kDifference_m;
      }
      if (!whole) continue;
      const double weight = huber(r->squaredNorm(), kHuberSigmas * sigma).weight;
      H += weight * J.transpose() * J;
      g += weight * J.transpose() * *r;
    }
    // The pair's own translation eliminated.
    const Mat3 H_pp = Mat3(H.bottomRightCorner<3, 3>()) + 1e-4 * static_cast<double>(pair.features.size()) * Mat3::Identity();
    const MatrixXd gain = H.topRightCorner(n, 3) * H_pp.inverse();
    const MatrixXd reduced = H.topLeftCorner(n, n) - gain * H.bottomLeftCorner(3, n);
    const VectorXd reduced_g = g.head(n) - gain * g.tail<3>();
    MatrixXd H_all = MatrixXd::Zero(kUnknowns, kUnknowns);
    VectorXd g_all = VectorXd::Zero(kUnknowns);
    for (Eigen::Index i = 0; i < n; ++i) {
      g_all(free[static_cast<std::size_t>(i)]) = reduced_g(i);
      for (Eigen::Index j = 0; j < n; ++j)
        H_all(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(j)]) = reduced(i, j);
    }
    fit.add(static_cast<int>(k * BlockFit::kStretches / pairs.size()), H_all, g_all);
  }
  return fit;
}

std::optional<BlockSolution> Problem::converge(const std::vector<int>& free, VectorXd& x) {
  std::optional<BlockSolution> last;
  for (int i = 0; i < kIterations; ++i) {
    last = linearise(x, free).solve(free);
    if (!last) return std::nullopt;
    x += last->x;
  }
  const Hypothesis at(start, x);
  const double sigma = std::max(typical_error(at), 0.03);
  for (FramePair& pair : pairs) settle(at, pair, sigma);
  return last;
}

Problem make_problem(const std::vector<FramePair>& pairs, const ImuSeries& imu, const MotionStart& start) {
  Problem problem{{}, imu, start};
  const Duration room = Duration::from_seconds(0.1), offset = Duration::from_seconds(start.offset_s);
  for (const FramePair& pair : pairs) {
    if (!imu.covers(pair.a + offset - room, pair.b + offset + room)) continue;
    FramePair thin = pair;
    thin.features.clear();
    const std::size_t step = (pair.features.size() + kFeaturesOfAPair - 1) / kFeaturesOfAPair;
    for (std::size_t i = 0; i < pair.features.size(); i += step) thin.features.push_back(pair.features[i]);
    problem.pairs.push_back(std::move(thin));
  }
  return problem;
}

std::vector<int> with(std::vector<int> free, const std::vector<int>& more) {
  for (const int i : more)
    if (std::find(free.begin(), free.end(), i) == free.end()) free.push_back(i);
  return free;
}

struct Candidate {
  const Group* group = nullptr;
  Problem problem;
  VectorXd x;
  std::vector<int> free;
  BlockSolution solution;
  double error_px = 0;
};

std::optional<Candidate> best_group(const Problem& problem, const std::vector<int>& free, const VectorXd& x) {
  std::optional<Candidate> best;
  for (const Group& group : groups()) {
    if (std::find(free.begin(), free.end(), group.unknowns.front()) != free.end()) continue;
    Candidate candidate{&group, problem, x, with(free, group.unknowns), {}, 0};
    auto solution = candidate.problem.converge(candidate.free, candidate.x);
    if (!solution) continue;
    candidate.solution = std::move(*solution);
    candidate.error_px = candidate.problem.capped_error(Hypothesis(problem.start, candidate.x));
    if (!best || candidate.error_px < best->error_px) best.emplace(std::move(candidate));
  }
  return best;
}

MotionChange change_of(const Candidate& best, double explained_px) {
  MotionChange change;
  change.kind = best.group->kind, change.explained_px = explained_px;
  const auto n = static_cast<Eigen::Index>(best.group->unknowns.size());
  change.amount = best.x(best.group->unknowns);
  change.covariance = best.solution.covariance.bottomRightCorner(n, n);
  return change;
}

bool significant(const MotionChange& change) {
  for (Eigen::Index i = 0; i < change.amount.size(); ++i)
    if (std::abs(change.amount(i)) > kSignificant * std::sqrt(change.covariance(i, i))) return true;
  return false;
}

}  // namespace

MotionFit fit_motion(const std::vector<FramePair>& pairs, const ImuSeries& imu, const MotionStart& start) {
  MotionFit fit;
  Problem problem = make_problem(pairs, imu, start);
  if (problem.pairs.size() < kFewestPairs) return fit;
  const std::vector<int> bias{kBias, kBias + 1, kBias + 2};
  std::vector<int> free = bias;
  VectorXd x = VectorXd::Zero(kUnknowns);
  if (!problem.converge(free, x)) return fit;
  fit.usable = true;
  fit.error_px = problem.typical_error(Hypothesis(start, x));
  double capped = problem.capped_error(Hypothesis(start, x));
  for (int round = 0; round < kRounds; ++round) {
    auto best = best_group(problem, free, x);
    if (!best) break;
    const MotionChange change = change_of(*best, std::sqrt(std::max(capped * capped - best->error_px * best->error_px, 0.0)));
    if (!significant(change) || !(best->error_px < capped)) break;
    if (change.amount.norm() > best->group->practical) fit.changes.push_back(change);
    capped = best->error_px;
    x = best->x;
    free = best->free;
    problem.pairs = std::move(best->problem.pairs);
  }
  // Changes found early are known better beside those found later.
  free = with(with({kTime, kRotation, kRotation + 1, kRotation + 2}, bias), free);
  const auto last = problem.converge(free, x);
  if (!last) return fit;
  const Hypothesis at(start, x);
  fit.remaining_px = problem.typical_error(at);
  fit.R_CB = at.R_CB, fit.offset_s = start.offset_s + x(kTime), fit.gyro_bias_radps = at.bias;
  const VectorXd sigma = last->covariance.diagonal().cwiseSqrt();
  fit.offset_sigma_s = sigma(0);
  fit.rotation_sigma_rad = sigma.segment<3>(1);
  for (MotionChange& change : fit.changes)
    for (const Group& group : groups())
      if (group.kind == change.kind)
        for (std::size_t i = 0; i < group.unknowns.size(); ++i) {
          const auto place = std::find(free.begin(), free.end(), group.unknowns[i]) - free.begin();
          change.amount(static_cast<Eigen::Index>(i)) = x(group.unknowns[i]);
          change.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)) = std::pow(sigma(place), 2);
        }
  return fit;
}

}  // namespace fbvins
