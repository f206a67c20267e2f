// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/stereo_fit.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/doctor/block_fit.hpp"
#include "fbvins/doctor/lens_change.hpp"
#include "fbvins/features/epipolar_ransac.hpp"
#include "fbvins/frontend/median.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Unknowns: rotation of C1 (rad, about its axes), direction of the baseline (rad), left, right and both lenses (logarithm of the
// focal length, principal point in px, two radial coefficients), delay of the right image (s).
constexpr int kOfLens = 5;
enum : int {
  kTurn = 0,
  kBaseline = 3,
  kLeft = 5,
  kRight = kLeft + kOfLens,
  kBoth = kRight + kOfLens,
  kDelay = kBoth + kOfLens,
  kUnknowns
};
enum : int { kFocal = 0, kCentre = 1, kRadial = 3 };  // of a lens

using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
Unknowns of_all(double turn, double baseline, const Eigen::Matrix<double, kOfLens, 1>& lens, double delay) {
  Unknowns all;
  all << turn, turn, turn, baseline, baseline, lens, lens, lens, delay;
  return all;
}
const Unknowns kPriorSigma = of_all(0.3, 0.3, (Eigen::Matrix<double, kOfLens, 1>() << 0.5, 100, 100, 0.3, 0.3).finished(), 0.1);
/// Steps of the numeric derivatives.
const Unknowns kStep = of_all(1e-5, 1e-5, (Eigen::Matrix<double, kOfLens, 1>() << 1e-5, 1e-2, 1e-2, 1e-5, 1e-5).finished(), 1e-4);

struct Group {
  FindingKind kind;
  WhichLens lens;
  std::vector<int> unknowns;
};
const std::vector<Group>& groups() {
  static const std::vector<Group> all = [] {
    std::vector<Group> made{{FindingKind::right_camera_turned, WhichLens::right, {kTurn, kTurn + 1, kTurn + 2}},
                            {FindingKind::baseline_direction, WhichLens::right, {kBaseline, kBaseline + 1}},
                            {FindingKind::stereo_sync, WhichLens::right, {kDelay}}};
    for (const auto& [lens, first] :
         {std::pair{WhichLens::left, +kLeft}, {WhichLens::right, +kRight}, {WhichLens::both, +kBoth}}) {
      made.push_back({FindingKind::focal_length, lens, {first + kFocal}});
      made.push_back({FindingKind::principal_point, lens, {first + kCentre, first + kCentre + 1}});
      made.push_back({FindingKind::distortion, lens, {first + kRadial, first + kRadial + 1}});
    }
    return made;
  }();
  return all;
}
/// Whether an unknown changes where the rays of a camera are.
bool bends_left(int unknown) { return unknown >= kLeft && unknown < kDelay && (unknown < kRight || unknown >= kBoth); }
bool bends_right(int unknown) { return unknown >= kRight && unknown < kDelay; }

/// A change must explain this much of the epipolar error (root mean square): half of what a feature is localised to.
constexpr double kPractical_px = 0.3;
/// And be this many of its standard deviations.
constexpr double kSignificant = 5;
/// A change of more numbers must leave less than this share of the error that one of fewer leaves.
constexpr double kAsGood = 0.97;
constexpr int kMostChanges = 3, kIterations = 12;
constexpr double kHardly = 1e-3, kLost_px = 60;
constexpr double kHuberSigmas = 2;
constexpr double kCap_px = 4;
/// Before and after an image, for how its turning changes.
constexpr Duration kHalfStep{20'000'000};
constexpr std::size_t kFewestMatches = 150, kMostMatches = 3000;

struct Match {
  Vec2 left, right;
  int stretch;
  Vec3 rate_C1, change_C1;  ///< turning at the image, rad/s, and how it changes, rad/s^2
  Vec3 velocity_C1;         ///< of the right camera, baselines a second
};

Vec3 tangent(const Vec3& t, int i) {
  const Vec3 axis = std::abs(t.x()) < 0.6 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 first = t.cross(axis).normalized();
  return i == 0 ? first : t.cross(first);
}

LensChange lens_of(const VectorXd& x, int first) {
  const VectorXd lens = x.segment<kOfLens>(first) + x.segment<kOfLens>(kBoth);
  return {lens(kFocal), {lens(kCentre), lens(kCentre + 1)}, {lens(kRadial), lens(kRadial + 1)}};
}

/// The rig at some unknowns, made once for all matches.
struct Hypothesis {
  Camera left, right;
  Mat3 R;
  Vec3 t;
  double delay, focal;

  Hypothesis(const StereoRig& rig, const VectorXd& x)
      : left(changed(rig.left, lens_of(x, kLeft))),
        right(changed(rig.right, lens_of(x, kRight))),
        delay(x(kDelay)),
        focal(rig.left.focal_px()) {
    const Pose<C1, C0> T = rig.T_C1C0();
    R = so3_exp(Vec3(x.segment<3>(kTurn))).toRotationMatrix() * T.R();
    const Vec3 direction = T.p.normalized();
    t = so3_exp(Vec3(x.segment<3>(kTurn))) * turned_baseline(direction, x.segment<2>(kBaseline));
  }
  std::optional<double> error_px(const Match& match) const {
    const auto a = left.undistort(match.left), b = right.undistort(match.right);
    if (!a || !b) return std::nullopt;
    return error_px(*a, *b, match);
  }
  double error_px(const Vec2& a, const Vec2& b, const Match& match) const {
    // The right image's rays as they were when the left image was taken.
    const Vec3 ray = so3_exp(delay * (match.rate_C1 + 0.5 * delay * match.change_C1)) * b.homogeneous();
    return focal * sampson_distance(hat(t - delay * match.velocity_C1) * R, a, ray.hnormalized());
  }
};

/// The right camera's motion at an image, as Match has it; none where it is not known.
struct RightMotion {
  Vec3 rate = Vec3::Zero(), change = Vec3::Zero(), velocity = Vec3::Zero();
};

RightMotion right_motion(Time t, const StereoRig& rig, const ImuSeries& imu, std::span<const FramePair> pairs) {
  RightMotion out;
  const Time at = t + Duration::from_seconds(rig.time_offset_s), before = at - kHalfStep, after = at + kHalfStep;
  if (!imu.covers(before, after)) return out;
  const Mat3 R_C1B = rig.T_BC1.R().transpose();
  out.rate = R_C1B * imu.at(at).gyro_radps;
  out.change = R_C1B * (imu.at(after).gyro_radps - imu.at(before).gyro_radps) / (after - before).seconds();
  const auto pair = std::find_if(pairs.begin(), pairs.end(), [&](const FramePair& p) { return p.a <= t && t < p.b; });
  if (pair == pairs.end()) return out;
  const Pose<C1, C0> T_C1C0 = rig.T_C1C0();
  // The mean of the pair, and what turning adds at the other end of the baseline.
  const Vec3 of_left = T_C1C0.R() * pair->p_CaCb / pair->dt_s(), lever = -T_C1C0.p;
  out.velocity = (of_left + out.rate.cross(lever)) / T_C1C0.p.norm();
  return out;
}

std::vector<Match> gather(std::span<const StereoView> views, const StereoRig& rig, const ImuSeries* imu,
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

std::vector<Match> thinned(const std::vector<Match>& matches) {
  const std::size_t step = (matches.size() + kMostMatches - 1) / kMostMatches;
  if (step <= 1) return matches;
  std::vector<Match> kept;
  for (std::size_t i = 0; i < matches.size(); i += step) kept.push_back(matches[i]);
  return kept;
}

double typical_error(const std::vector<Match>& matches, const Hypothesis& at) {
  std::vector<double> errors;
  for (const Match& match : matches)
    if (const auto error = at.error_px(match)) errors.push_back(std::abs(*error));
  return 1.48 * median(errors);
}

/// Root mean square with no error counting for more than the cap, so that wrong matches add the same to every hypothesis.
double capped_error(const std::vector<Match>& matches, const Hypothesis& at) {
  double sum = 0;
  for (const Match& match : matches) {
    const double error = std::min(std::abs(at.error_px(match).value_or(kCap_px)), kCap_px);
    sum += error * error;
  }
  return std::sqrt(sum / static_cast<double>(matches.size()));
}

RegionErrors by_region(const std::vector<Match>& matches, const Hypothesis& at, const Camera& left) {
  std::array<std::vector<double>, kRegions * kRegions> errors;
  for (const Match& match : matches) {
    const auto error = at.error_px(match);
    if (!error) continue;
    const int column = std::clamp(static_cast<int>(kRegions * match.left.x() / left.width()), 0, kRegions - 1);
    const int row = std::clamp(static_cast<int>(kRegions * match.left.y() / left.height()), 0, kRegions - 1);
    errors[static_cast<std::size_t>(row * kRegions + column)].push_back(*error);
  }
  RegionErrors medians{};
  for (std::size_t r = 0; r < medians.size(); ++r)
    if (errors[r].size() >= 10) medians[r] = median(errors[r]);
  return medians;
}

/// The problem linearised at x by the unknowns that are free; its residuals with the weights that their size at x gives them.
BlockFit linearise(const std::vector<Match>& matches, const StereoRig& rig, const VectorXd& x, const std::vector<int>& free) {
  const Hypothesis at(rig, x);
  std::vector<Hypothesis> moved;
  for (const int i : free) {
    VectorXd y = x;
    y(i) += kStep(i);
    moved.emplace_back(rig, y);
  }
  const double sigma = std::max(typical_error(matches, at), 0.05);
  BlockFit fit(kPriorSigma, sigma);
  std::vector<MatrixXd> H(BlockFit::kStretches, MatrixXd::Zero(kUnknowns, kUnknowns));
  std::vector<VectorXd> g(BlockFit::kStretches, VectorXd::Zero(kUnknowns));
  for (const Match& match : matches) {
    const auto a = at.left.undistort(match.left), b = at.right.undistort(match.right);
    if (!a || !b) continue;
    const double r = at.error_px(*a, *b, match);
    VectorXd J = VectorXd::Zero(kUnknowns);
    bool whole = true;
    for (std::size_t k = 0; k < free.size() && whole; ++k) {
      const int i = free[k];
      const Hypothesis& there = moved[k];
      const auto a_there = bends_left(i) ? there.left.undistort(match.left) : a;
      const auto b_there = bends_right(i) ? there.right.undistort(match.right) : b;
      whole = a_there && b_there;
      if (whole) J(i) = (there.error_px(*a_there, *b_there, match) - r) / kStep(i);
    }
    if (!whole) continue;
    const double weight = huber(r * r, kHuberSigmas * sigma).weight;
    H[static_cast<std::size_t>(match.stretch)] += weight * J * J.transpose();
    g[static_cast<std::size_t>(match.stretch)] += weight * r * J;
  }
  for (int s = 0; s < BlockFit::kStretches; ++s) fit.add(s, H[static_cast<std::size_t>(s)], g[static_cast<std::size_t>(s)]);
  return fit;
}

/// Mean distance, none counting for more than a match that cannot be undistorted at all.
double mean_error(const std::vector<Match>& matches, const Hypothesis& at) {
  double sum = 0;
  for (const Match& match : matches) sum += std::min(std::abs(at.error_px(match).value_or(kLost_px)), kLost_px);
  return sum / static_cast<double>(matches.size());
}

/// Goes along the step, as far as that makes the error smaller. False once it hardly does.
bool step_down(const std::vector<Match>& matches, const StereoRig& rig, const VectorXd& step, double& error, VectorXd& x) {
  for (const double share : {1.0, 0.5, 0.25, 0.1}) {
    const VectorXd there = x + share * step;
    const double error_there = mean_error(matches, Hypothesis(rig, there));
    if (error_there >= error) continue;
    const bool goes_on = error_there < (1 - kHardly) * error;
    x = there, error = error_there;
    return goes_on;
  }
  return false;
}

/// Gauss-Newton on the free unknowns from x.
std::optional<BlockSolution> converge(const std::vector<Match>& matches, const StereoRig& rig, const std::vector<int>& free,
                                      VectorXd& x) {
  std::optional<BlockSolution> last;
  double error = mean_error(matches, Hypothesis(rig, x));
  for (int i = 0; i < kIterations; ++i) {
    last = linearise(matches, rig, x, free).solve(free);
    if (!last) return std::nullopt;
    if (!step_down(matches, rig, last->x, error, x)) break;
  }
  return last;
}

/// Nobody's lens is half as long again as he thinks: such a fit is of errors that no calibration has.
bool plausible(const VectorXd& x) {
  constexpr double kMostLogFocal = 0.3;
  return std::max({std::abs(x(kLeft)), std::abs(x(kRight)), std::abs(x(kBoth))}) < kMostLogFocal;
}

struct Candidate {
  const Group* group = nullptr;
  VectorXd x;
  std::vector<int> free;
  BlockSolution solution;
  double error_px = 0;
};

/// The group whose unknowns, set free beside those that are, leave the smallest error.
std::optional<Candidate> best_group(const std::vector<Match>& matches, const StereoRig& rig, const std::vector<int>& free,
                                    const VectorXd& x) {
  std::optional<Candidate> best;
  for (const Group& group : groups()) {
    if (std::find(free.begin(), free.end(), group.unknowns.front()) != free.end()) continue;
    Candidate candidate{&group, x, free, {}, 0};
    candidate.free.insert(candidate.free.end(), group.unknowns.begin(), group.unknowns.end());
    auto solution = converge(matches, rig, candidate.free, candidate.x);
    if (!solution || !plausible(candidate.x)) continue;
    candidate.solution = std::move(*solution);
    candidate.error_px = capped_error(matches, Hypothesis(rig, candidate.x));
    const std::size_t n = group.unknowns.size(), n_best = best ? best->group->unknowns.size() : n;
    const double handicap = n < n_best ? kAsGood : n > n_best ? 1 / kAsGood : 1;
    if (!best || candidate.error_px * handicap < best->error_px) best = std::move(candidate);
  }
  return best;
}

StereoChange change_of(const Candidate& best, double explained_px) {
  StereoChange change;
  change.kind = best.group->kind, change.lens = best.group->lens, change.explained_px = explained_px;
  const auto n = static_cast<Eigen::Index>(best.group->unknowns.size());
  change.amount = best.x(best.group->unknowns);
  change.covariance = best.solution.covariance.bottomRightCorner(n, n);
  return change;
}

double sigmas(const StereoChange& change) {
  double largest = 0;
  for (Eigen::Index i = 0; i < change.amount.size(); ++i)
    largest = std::max(largest, std::abs(change.amount(i)) / std::sqrt(std::max(change.covariance(i, i), 1e-30)));
  return largest;
}

StereoRig corrected(const StereoRig& rig, const Hypothesis& at) {
  StereoRig out = rig;
  out.left = at.left, out.right = at.right;
  const Pose<C1, C0> T_C1C0{at.R, rig.T_C1C0().p.norm() * at.t};
  out.T_BC1 = rig.T_BC0 * T_C1C0.inverse();
  return out;
}

}  // namespace

Vec3 turned_baseline(const Vec3& p_C1C0, const Eigen::Vector2d& amount) {
  const Vec3 direction = p_C1C0.normalized();
  return so3_exp(amount(0) * tangent(direction, 0) + amount(1) * tangent(direction, 1)) * p_C1C0;
}

StereoFit fit_stereo(std::span<const StereoView> views, const StereoRig& rig, const ImuSeries* imu,
                     std::span<const FramePair> pairs) {
  StereoFit fit;
  fit.rig = rig;
  const std::vector<Match> matches = thinned(gather(views, rig, imu, pairs));
  fit.matches = static_cast<int>(matches.size());
  if (matches.size() < kFewestMatches) return fit;
  VectorXd x = VectorXd::Zero(kUnknowns);
  fit.error_px = typical_error(matches, Hypothesis(rig, x));
  double capped = capped_error(matches, Hypothesis(rig, x));
  fit.regions = by_region(matches, Hypothesis(rig, x), rig.left);
  std::vector<int> free;
  while (fit.changes.size() < kMostChanges) {
    const auto best = best_group(matches, rig, free, x);
    if (!best) break;
    const double explained = std::sqrt(std::max(capped * capped - best->error_px * best->error_px, 0.0));
    const StereoChange change = change_of(*best, explained);
    if (explained < kPractical_px || sigmas(change) < kSignificant) break;
    fit.changes.push_back(change);
    capped = best->error_px;
    x = best->x;
    free = best->free;
    // What a late image does is told to first order only: its remains look like anything.
    if (change.kind == FindingKind::stereo_sync) break;
  }
  const Hypothesis after(rig, x);
  fit.remaining_px = typical_error(matches, after);
  fit.remaining = by_region(matches, after, rig.left);
  fit.rig = corrected(rig, after);
  return fit;
}

}  // namespace fbvins
