// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/stereo_problem.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/median.hpp"
#include "fbvins/doctor/lens_change.hpp"
#include "fbvins/features/epipolar_ransac.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace doctor::stereo {
namespace {

using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
Unknowns of_all(double turn, double baseline, const Eigen::Matrix<double, kOfLens, 1>& lens, double delay) {
  Unknowns all;
  all << turn, turn, turn, baseline, baseline, lens, lens, lens, delay;
  return all;
}
const Unknowns kPriorSigma = of_all(0.3, 0.3, (Eigen::Matrix<double, kOfLens, 1>() << 0.5, 100, 100, 0.3, 0.3).finished(), 0.1);
/// Steps of the numeric derivatives.
const Unknowns kStep = of_all(1e-5, 1e-5, (Eigen::Matrix<double, kOfLens, 1>() << 1e-5, 1e-2, 1e-2, 1e-5, 1e-5).finished(), 1e-4);

/// Whether an unknown changes the rays of a camera's pixels.
bool bends_left(int unknown) { return unknown >= kLeft && unknown < kDelay && (unknown < kRight || unknown >= kBoth); }
bool bends_right(int unknown) { return unknown >= kRight && unknown < kDelay; }

constexpr int kIterations = 12;
constexpr double kHardly = 1e-3, kLost_px = 60;
constexpr double kHuberSigmas = 2, kLeastSigma_px = 0.05;
constexpr double kCap_px = 4;
/// Half of the interval over which the angular acceleration at an image is taken.
constexpr Duration kHalfStep{20'000'000};

Vec3 tangent(const Vec3& t, int i) {
  const Vec3 axis = std::abs(t.x()) < 0.6 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 first = t.cross(axis).normalized();
  return i == 0 ? first : t.cross(first);
}

LensChange lens_of(const VectorXd& x, int first) {
  const VectorXd lens = x.segment<kOfLens>(first) + x.segment<kOfLens>(kBoth);
  return {lens(kFocal), {lens(kCentre), lens(kCentre + 1)}, {lens(kRadial), lens(kRadial + 1)}};
}

/// The right camera's motion at an image, as in Match; 0 where it is not known.
struct RightMotion {
  Vec3 rate = Vec3::Zero(), change = Vec3::Zero(), velocity = Vec3::Zero();
};

RightMotion right_motion(Time t, const StereoRig& rig, const ImuSeries& imu, std::span<const FramePair> pairs) {
  RightMotion out;
  const Time at = t + Duration::from_seconds(rig.time_offset_s), before = at - kHalfStep, after = at + kHalfStep;
  if (!imu.covers(before, after)) return out;
  const Mat3 R_C1B = rig.T_BC1().R().transpose();
  out.rate = R_C1B * imu.at(at).gyro_radps;
  out.change = R_C1B * (imu.at(after).gyro_radps - imu.at(before).gyro_radps) / (after - before).seconds();
  const auto pair = std::find_if(pairs.begin(), pairs.end(), [&](const FramePair& p) { return p.a <= t && t < p.b; });
  if (pair == pairs.end()) return out;
  const Pose<C1, C0> T_C1C0 = rig.T_C1C0();
  // The left camera's mean velocity, and what rotation adds at the other end of the baseline.
  const Vec3 of_left = T_C1C0.R() * pair->p_CaCb / pair->dt_s(), lever = -T_C1C0.p;
  out.velocity = (of_left + out.rate.cross(lever)) / T_C1C0.p.norm();
  return out;
}

}  // namespace

std::vector<Match> collect(std::span<const StereoView> views, const StereoRig& rig, const ImuSeries* imu,
                           std::span<const FramePair> pairs) {
  std::vector<Match> matches;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const RightMotion motion = imu != nullptr ? right_motion(views[v].t, rig, *imu, pairs) : RightMotion{};
    const int stretch = static_cast<int>(v * BlockFit::kStretches / views.size());
    for (const StereoPoint& point : views[v].points)
      matches.push_back({point.left, point.right, stretch, motion.rate, motion.change, motion.velocity});
  }
  return matches;
}

Hypothesis::Hypothesis(const StereoRig& rig, const VectorXd& x)
    : left(changed(rig.left(), lens_of(x, kLeft))),
      right(changed(rig.right(), lens_of(x, kRight))),
      delay(x(kDelay)),
      focal(rig.left().focal_px()) {
  const Pose<C1, C0> T = rig.T_C1C0();
  const Quat turn = so3_exp(Vec3(x.segment<3>(kTurn)));
  R = turn.toRotationMatrix() * T.R();
  t = turn * turned_baseline(T.p.normalized(), x.segment<2>(kBaseline));
}

std::optional<double> Hypothesis::error_px(const Match& match) const {
  const auto a = left.undistort(match.left), b = right.undistort(match.right);
  if (!a || !b) return std::nullopt;
  return error_px(*a, *b, match);
}

double Hypothesis::error_px(const Vec2& a, const Vec2& b, const Match& match) const {
  // The right image's rays as they were when the left image was taken.
  const Vec3 ray = so3_exp(delay * (match.rate_C1 + 0.5 * delay * match.change_C1)) * b.homogeneous();
  return focal * sampson_distance(hat(t - delay * match.velocity_C1) * R, a, ray.hnormalized());
}

double typical_error_px(std::span<const Match> matches, const Hypothesis& at) {
  std::vector<double> errors;
  for (const Match& match : matches)
    if (const auto error = at.error_px(match)) errors.push_back(std::abs(*error));
  return 1.48 * median(errors);
}

namespace {

/// Mean distance, capped at that of a match that cannot be undistorted.
double mean_error(std::span<const Match> matches, const Hypothesis& at) {
  double sum = 0;
  for (const Match& match : matches) sum += std::min(std::abs(at.error_px(match).value_or(kLost_px)), kLost_px);
  return sum / static_cast<double>(matches.size());
}

/// A match's error and its derivatives; false where a ray cannot be undistorted.
bool linearise(const Match& match, const Hypothesis& at, std::span<const Moved<Hypothesis>> moved, double& r, VectorXd& J) {
  const auto a = at.left.undistort(match.left), b = at.right.undistort(match.right);
  if (!a || !b) return false;
  r = at.error_px(*a, *b, match);
  J.setZero(kUnknowns);
  for (const auto& [unknown, step, there] : moved) {
    const auto a_there = bends_left(unknown) ? there.left.undistort(match.left) : a;
    const auto b_there = bends_right(unknown) ? there.right.undistort(match.right) : b;
    if (!a_there || !b_there) return false;
    J(unknown) = (there.error_px(*a_there, *b_there, match) - r) / step;
  }
  return true;
}

}  // namespace
}  // namespace doctor::stereo

using namespace doctor::stereo;

Vec3 turned_baseline(const Vec3& p_C1C0, const Eigen::Vector2d& amount) {
  const Vec3 direction = p_C1C0.normalized();
  return so3_exp(amount(0) * tangent(direction, 0) + amount(1) * tangent(direction, 1)) * p_C1C0;
}

/// Normal equations at x in the free unknowns, with the Huber weights of the residuals at x.
BlockFit StereoProblem::linearise() const {
  const Hypothesis at = hypothesis();
  const auto moved = moved_from<Hypothesis>(*rig_, x, free, kStep);
  const double sigma = std::max(typical_error_px(matches_, at), kLeastSigma_px);
  BlockFit fit(kPriorSigma, sigma);
  std::vector<MatrixXd> H(BlockFit::kStretches, MatrixXd::Zero(kUnknowns, kUnknowns));
  std::vector<VectorXd> g(BlockFit::kStretches, VectorXd::Zero(kUnknowns));
  double r = 0;
  VectorXd J;
  for (const Match& match : matches_) {
    if (!doctor::stereo::linearise(match, at, moved, r, J)) continue;
    const double weight = huber(r * r, kHuberSigmas * sigma).weight;
    H[static_cast<std::size_t>(match.stretch)] += weight * J * J.transpose();
    g[static_cast<std::size_t>(match.stretch)] += weight * r * J;
  }
  for (int s = 0; s < BlockFit::kStretches; ++s) fit.add(s, H[static_cast<std::size_t>(s)], g[static_cast<std::size_t>(s)]);
  return fit;
}

/// Backtracking along the step, within the range of the lens models. False once the error hardly decreases.
bool StereoProblem::step_down(const VectorXd& step, double& error) {
  for (const double share : {1.0, 0.5, 0.25, 0.1, 0.03}) {
    const VectorXd there = x + share * step;
    const Hypothesis at(*rig_, there);
    if (!in_range(at.left) || !in_range(at.right)) continue;
    const double error_there = mean_error(matches_, at);
    if (error_there >= error) continue;
    const bool goes_on = error_there < (1 - kHardly) * error;
    x = there, error = error_there;
    return goes_on;
  }
  return false;
}

std::optional<BlockSolution> StereoProblem::converge() {
  std::optional<BlockSolution> last;
  double error = mean_error(matches_, hypothesis());
  for (int i = 0; i < kIterations; ++i) {
    last = linearise().solve(free);
    if (!last || !step_down(last->x, error)) break;
  }
  return last;
}

/// No focal length is wrong by a third, no principal point lies near the image's edge, and no lens is another kind's: such a fit
/// explains something else than a wrong calibration. Rays that a distortion draws together all err less.
bool StereoProblem::plausible() const {
  constexpr double kMostLogFocal = 0.3, kMostRadial[] = {1, 3}, kMostOffCentre = 0.25;
  for (const int lens : {kLeft, kRight, kBoth}) {
    const double off_centre_px = x.segment<2>(lens + kCentre).norm();
    if (std::abs(x(lens + kFocal)) >= kMostLogFocal || off_centre_px >= kMostOffCentre * rig_->left().width()) return false;
    if (std::abs(x(lens + kRadial)) >= kMostRadial[0] || std::abs(x(lens + kRadial + 1)) >= kMostRadial[1]) return false;
  }
  return true;
}

double StereoProblem::capped_error() const {
  const Hypothesis at = hypothesis();
  double sum = 0;
  for (const Match& match : matches_) {
    const double error = std::min(std::abs(at.error_px(match).value_or(kCap_px)), kCap_px);
    sum += error * error;
  }
  return std::sqrt(sum / static_cast<double>(matches_.size()));
}

}  // namespace fbvins
