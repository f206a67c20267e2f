// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/motion_problem.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "fbvins/core/median.hpp"
#include "fbvins/doctor/lens_change.hpp"
#include "fbvins/doctor/two_view.hpp"
#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/imu/propagation.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {

using namespace doctor::motion;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace doctor::motion {

Hypothesis::Hypothesis(const MotionStart& start, const VectorXd& x)
    : camera(changed(start.rig.left(), {x(kFocal), {x(kCentre), x(kCentre + 1)}, {x(kRadial), x(kRadial + 1)}})),
      R_CB(start.rig.T_BC0().R().transpose() * so3_exp(Vec3(x.segment<3>(kRotation))).toRotationMatrix()),
      offset(Duration::from_seconds(start.offset_s + x(kTime))),
      bias(x.segment<3>(kBias)),
      scale((x.segment<3>(kAxis).array() + x(kScale)).exp().matrix()),
      by_force((Mat3() << x(kForce), x(kForce + 1), x(kForce + 2), x(kForce + 3), x(kForce + 4), x(kForce + 5), x(kForce + 6),
                x(kForce + 7), x(kForce + 8))
                   .finished()),
      rolling_s(start.rig.times(0).line_delay_s * start.rig.left().height() + x(kRolling)) {}

}  // namespace doctor::motion

namespace {

constexpr std::array<double, kUnknowns> kPriorSigma{0.5, 0.5, 0.5, 0.2, 0.3,  0.3,  0.3,  0.3,  0.3,  0.3,  0.3,  0.1,  0.3,
                                                    50,  50,  0.2, 0.2, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02};
constexpr std::array<double, kUnknowns> kStep{1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-4, 1e-4, 1e-4, 1e-4, 1e-5, 1e-5,
                                              1e-2, 1e-2, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5};

constexpr int kIterations = 4;
/// Of a step towards the end of a lens model's range.
constexpr double kLeastShare = 1e-3;
constexpr double kCap_px = 3, kHuberSigmas = 2, kLeastSigma_px = 0.03;
constexpr std::size_t kFeaturesOfAPair = 40;
constexpr double kDifference_m = 1e-4;
/// Weight, per feature, of a prior that keeps a translation where it is, for components that are not observable.
constexpr double kTranslationPrior = 1e-4;

/// How the camera turns around an image's time: a parabola through the integrals of the rate, which vibration does not disturb.
struct LineTurn {
  Vec3 rate = Vec3::Zero(), half_gain = Vec3::Zero();  ///< in C, rad/s, rad/s^2

  LineTurn(const Hypothesis& h, Time t, const ImuSeries& imu) {
    const double side_s = std::max(0.5 * std::abs(h.rolling_s), kLeastSide_s);
    const Duration side = Duration::from_seconds(side_s);
    const auto turned = [&](Time from, Time to) {
      return Vec3(h.R_CB * h.scale.cwiseProduct(imu.turned(from, to) - (to - from).seconds() * h.bias));
    };
    const Vec3 before = turned(t - side, t), after = turned(t, t + side);
    rate = (before + after) / (2 * side_s);
    half_gain = (after - before) / (2 * side_s * side_s);
  }
  /// `v`, seen `late_s` after the image's time, in the axes of that time.
  Vec3 back(double late_s, const Vec3& v) const {
    const Vec3 theta = late_s * rate + late_s * late_s * half_gain, turned = theta.cross(v);
    return v + turned + 0.5 * theta.cross(turned);
  }
  /// The other way.
  Vec3 to(double late_s, const Vec3& v) const {
    const Vec3 theta = late_s * rate + late_s * late_s * half_gain, turned = theta.cross(v);
    return v - turned + 0.5 * theta.cross(turned);
  }

 private:
  static constexpr double kLeastSide_s = 8e-3;
};

/// A pair's rotation under one hypothesis.
struct PredictedTurn {
  Mat3 R_ba;
  LineTurn around_a, around_b;
  bool without_depths;

  PredictedTurn(const Hypothesis& h, const FramePair& pair, const ImuSeries& imu)
      : around_a(h, pair.a + h.offset, imu), around_b(h, pair.b + h.offset, imu), without_depths(pair.without_depths) {
    const Time a = pair.a + h.offset, b = pair.b + h.offset;
    ImuSegment segment = imu.segment(a, b);
    if (!h.by_force.isZero(0))
      for (ImuSample& sample : segment.samples) sample.gyro_radps -= h.by_force * sample.accel_mps2;
    const Vec3 turn_B = h.scale.cwiseProduct(so3_log(integrate_gyro(segment, h.bias)));
    R_ba = so3_exp(-(h.R_CB * turn_B)).toRotationMatrix();
  }
};

/// Both directions of a feature in the axes of b at its time.
std::optional<std::pair<Vec3, Vec3>> rays_in_b(const Hypothesis& h, const PredictedTurn& turn, const PairedFeature& feature,
                                               const Vec2& ray_a) {
  const auto ray_b = h.camera.undistort(feature.b_px);
  if (!ray_b) return std::nullopt;
  const double height = h.camera.height();
  const double late_a = h.rolling_s * (feature.a_px.y() / height - 0.5), late_b = h.rolling_s * (feature.b_px.y() / height - 0.5);
  return std::pair(Vec3(turn.R_ba * turn.around_a.back(late_a, ray_a.homogeneous().normalized())),
                   turn.around_b.back(late_b, ray_b->homogeneous().normalized()));
}

/// Reprojection error in b: X_b = R_ba (x_a - rho p_CaCb), each image line at its own time. None behind the camera. Without
/// depths that across the epipolar line alone.
std::optional<Vec2> residual(const Hypothesis& h, const PredictedTurn& turn, const PairedFeature& feature, const Vec2& ray_a,
                             const Vec3& p_ab) {
  const double height = h.camera.height();
  const double late_a = h.rolling_s * (feature.a_px.y() / height - 0.5), late_b = h.rolling_s * (feature.b_px.y() / height - 0.5);
  if (turn.without_depths) {
    const auto rays = rays_in_b(h, turn, feature, ray_a);
    if (!rays) return std::nullopt;
    return Vec2(h.camera.focal_px() * epipolar_angle(rays->first, rays->second, turn.R_ba * p_ab), 0);
  }
  const Vec3 X_a = turn.around_a.back(late_a, ray_a.homogeneous()) - feature.inverse_depth * p_ab;
  const Vec3 X_b = turn.around_b.to(late_b, turn.R_ba * X_a);
  if (X_b.z() < 0.05) return std::nullopt;
  return Vec2(h.camera.distort(X_b.hnormalized()) - feature.b_px);
}

/// Derivative of a feature's residual r by the pair's translation, by differences; false where it has none.
bool by_translation(const Hypothesis& h, const PredictedTurn& turn, const PairedFeature& feature, const Vec2& ray,
                    const Vec3& p_ab, const Vec2& r, Eigen::Matrix<double, 2, 3>& J) {
  for (int i = 0; i < 3; ++i) {
    const auto there = residual(h, turn, feature, ray, p_ab + kDifference_m * Vec3::Unit(i));
    if (!there) return false;
    J.col(i) = (*there - r) / kDifference_m;
  }
  return true;
}

/// The direction of a pair's translation under a hypothesis.
Vec3 direction_under(const Hypothesis& h, const PredictedTurn& turn, const FramePair& pair) {
  RayPairs rays;
  for (const PairedFeature& feature : pair.features) {
    const auto ray = h.camera.undistort(feature.a_px);
    const auto both = ray ? rays_in_b(h, turn, feature, *ray) : std::nullopt;
    if (both) rays.a.push_back(both->first), rays.b.push_back(both->second);
  }
  return rays.a.empty() ? pair.p_CaCb : Vec3(turn.R_ba.transpose() * translation_direction(rays));
}

/// Sets the pair's translation to the best one under a hypothesis, starting at the present one where features have depths.
void settle(const Hypothesis& h, FramePair& pair, const ImuSeries& imu, double sigma) {
  const PredictedTurn turn(h, pair, imu);
  if (pair.without_depths) pair.p_CaCb = direction_under(h, turn, pair);
  for (int iteration = 0; iteration < 3; ++iteration) {
    Mat3 H = kTranslationPrior * static_cast<double>(pair.features.size()) * Mat3::Identity();
    Vec3 g = Vec3::Zero();
    for (const PairedFeature& feature : pair.features) {
      const auto ray = h.camera.undistort(feature.a_px);
      const auto r = ray ? residual(h, turn, feature, *ray, pair.p_CaCb) : std::nullopt;
      Eigen::Matrix<double, 2, 3> J;
      if (!r || !by_translation(h, turn, feature, *ray, pair.p_CaCb, *r, J)) continue;
      const double weight = huber(r->squaredNorm(), kHuberSigmas * sigma).weight;
      H += weight * J.transpose() * J;
      g += weight * J.transpose() * *r;
    }
    const Vec3 step = -Ldlt<3>(H).solve(g);
    if (!step.allFinite()) return;
    pair.p_CaCb += step;
    if (pair.without_depths) pair.p_CaCb.normalize();
  }
}

/// Normal equations of one pair in the free unknowns, its translation eliminated.
struct PairSystem {
  MatrixXd H;
  VectorXd g;

  PairSystem(const FramePair& pair, const Hypothesis& at, std::span<const Moved<Hypothesis>> moved, const ImuSeries& imu,
             double sigma)
      : n_(static_cast<Eigen::Index>(moved.size())), H_(MatrixXd::Zero(n_ + 3, n_ + 3)), g_(VectorXd::Zero(n_ + 3)) {
    const PredictedTurn turn(at, pair, imu);
    std::vector<PredictedTurn> turns;
    for (const auto& m : moved) turns.emplace_back(m.there, pair, imu);
    for (const PairedFeature& feature : pair.features) add(feature, pair.p_CaCb, at, turn, moved, turns, sigma);
    eliminate(kTranslationPrior * static_cast<double>(pair.features.size()));
  }

 private:
  void add(const PairedFeature& feature, const Vec3& p_ab, const Hypothesis& at, const PredictedTurn& turn,
           std::span<const Moved<Hypothesis>> moved, const std::vector<PredictedTurn>& turns, double sigma) {
    const auto ray = at.camera.undistort(feature.a_px);
    const auto r = ray ? residual(at, turn, feature, *ray, p_ab) : std::nullopt;
    if (!r) return;
    MatrixXd J(2, n_ + 3);
    for (std::size_t k = 0; k < moved.size(); ++k) {
      const Hypothesis& there = moved[k].there;
      const auto ray_there = moved[k].unknown >= kFocal && moved[k].unknown < kForce ? there.camera.undistort(feature.a_px) : ray;
      const auto r_there = ray_there ? residual(there, turns[k], feature, *ray_there, p_ab) : std::nullopt;
      if (!r_there) return;
      J.col(static_cast<Eigen::Index>(k)) = (*r_there - *r) / moved[k].step;
    }
    Eigen::Matrix<double, 2, 3> J_p;
    if (!by_translation(at, turn, feature, *ray, p_ab, *r, J_p)) return;
    J.rightCols<3>() = J_p;
    const double weight = huber(r->squaredNorm(), kHuberSigmas * sigma).weight;
    H_ += weight * J.transpose() * J;
    g_ += weight * J.transpose() * *r;
  }
  void eliminate(double prior) {
    const Mat3 H_pp = Mat3(H_.bottomRightCorner<3, 3>()) + prior * Mat3::Identity();
    const MatrixXd gain = H_.topRightCorner(n_, 3) * H_pp.inverse();
    H = H_.topLeftCorner(n_, n_) - gain * H_.bottomLeftCorner(3, n_);
    g = g_.head(n_) - gain * g_.tail<3>();
  }

  Eigen::Index n_;
  MatrixXd H_;
  VectorXd g_;
};

}  // namespace

MotionProblem::MotionProblem(const std::vector<FramePair>& pairs, const ImuSeries& imu, const MotionStart& start)
    : x(VectorXd::Zero(kUnknowns)), imu_(&imu), start_(start) {
  const Duration room = Duration::from_seconds(0.1), offset = Duration::from_seconds(start.offset_s);
  for (const FramePair& pair : pairs) {
    if (!imu.covers(pair.a + offset - room, pair.b + offset + room)) continue;
    FramePair thin = pair;
    thin.features.clear();
    const std::size_t step = (pair.features.size() + kFeaturesOfAPair - 1) / kFeaturesOfAPair;
    for (std::size_t i = 0; i < pair.features.size(); i += step) thin.features.push_back(pair.features[i]);
    pairs_.push_back(std::move(thin));
  }
}

namespace {

template <class Take>
void for_each_residual(const std::vector<FramePair>& pairs, const ImuSeries& imu, const Hypothesis& h, Take&& take) {
  for (const FramePair& pair : pairs) {
    const PredictedTurn turn(h, pair, imu);
    for (const PairedFeature& feature : pair.features) {
      const auto ray = h.camera.undistort(feature.a_px);
      const auto r = ray ? residual(h, turn, feature, *ray, pair.p_CaCb) : std::nullopt;
      take(r ? r->norm() : kCap_px);
    }
  }
}

}  // namespace

double MotionProblem::typical_error() const {
  std::vector<double> norms;
  for_each_residual(pairs_, *imu_, hypothesis(), [&](double norm) { norms.push_back(norm); });
  const bool one_coordinate = !pairs_.empty() && pairs_.front().without_depths;
  return (one_coordinate ? 1.4826 : 0.85) * median(norms);  // of a normal, and of a Rayleigh distribution
}

double MotionProblem::capped_error() const {
  double sum = 0;
  int count = 0;
  for_each_residual(pairs_, *imu_, hypothesis(), [&](double norm) {
    sum += std::pow(std::min(norm, kCap_px), 2);
    ++count;
  });
  return std::sqrt(sum / std::max(count, 1));
}

BlockFit MotionProblem::linearise() {
  const Hypothesis at = hypothesis();
  const auto moved = moved_from<Hypothesis>(start_, x, free, Eigen::Map<const VectorXd>(kStep.data(), kUnknowns));
  const double sigma = std::max(typical_error(), kLeastSigma_px);
  BlockFit fit(Eigen::Map<const VectorXd>(kPriorSigma.data(), kUnknowns), sigma);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    settle(at, pairs_[k], *imu_, sigma);
    const PairSystem system(pairs_[k], at, moved, *imu_, sigma);
    MatrixXd H = MatrixXd::Zero(kUnknowns, kUnknowns);
    VectorXd g = VectorXd::Zero(kUnknowns);
    H(free, free) = system.H;
    g(free) = system.g;
    fit.add(static_cast<int>(k * BlockFit::kStretches / pairs_.size()), H, g);
  }
  return fit;
}

double MotionProblem::in_model(const VectorXd& step) const {
  double share = 1;
  while (share > 0 && !in_range(Hypothesis(start_, x + share * step).camera)) share = share > kLeastShare ? 0.5 * share : 0;
  return share;
}

std::optional<BlockSolution> MotionProblem::converge() {
  std::optional<BlockSolution> last;
  for (int i = 0; i < kIterations; ++i) {
    last = linearise().solve(free);
    if (!last) return std::nullopt;
    x += in_model(last->x) * last->x;
  }
  const Hypothesis at = hypothesis();
  const double sigma = std::max(typical_error(), kLeastSigma_px);
  for (FramePair& pair : pairs_) settle(at, pair, *imu_, sigma);
  return last;
}

}  // namespace fbvins
