// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/motion_fit.hpp"

#include <algorithm>

#include "fbvins/doctor/change_search.hpp"
#include "fbvins/doctor/motion_problem.hpp"

namespace fbvins {
namespace {

using namespace doctor::motion;

/// One axis' scale must explain more than that of all, which it does not where the rig turns about that axis only.
constexpr double kRareAxis = 1.03;
/// And nine unknowns must explain much more than one.
constexpr double kRareForce = 1.08;

const std::vector<ChangeGroup>& groups() {
  static const std::vector<ChangeGroup> all{
      {FindingKind::time_offset, WhichLens::left, {kTime}, 3e-3},
      {FindingKind::imu_camera_rotation, WhichLens::left, {kRotation, kRotation + 1, kRotation + 2}, 0.0175},
      {FindingKind::gyro_scale, WhichLens::left, {kScale}, 0.03},
      {FindingKind::gyro_scale, WhichLens::left, {kAxis}, 0.03, kRareAxis},
      {FindingKind::gyro_scale, WhichLens::left, {kAxis + 1}, 0.03, kRareAxis},
      {FindingKind::gyro_scale, WhichLens::left, {kAxis + 2}, 0.03, kRareAxis},
      {FindingKind::gyro_by_force,
       WhichLens::left,
       {kForce, kForce + 1, kForce + 2, kForce + 3, kForce + 4, kForce + 5, kForce + 6, kForce + 7, kForce + 8},
       2e-3,
       kRareForce},
      {FindingKind::rolling_shutter, WhichLens::left, {kRolling}, 4e-3},
      {FindingKind::focal_length, WhichLens::left, {kFocal}, 0.02},
      {FindingKind::principal_point, WhichLens::left, {kCentre, kCentre + 1}, 8},
      {FindingKind::distortion, WhichLens::left, {kRadial, kRadial + 1}, 0.05},
  };
  return all;
}
/// Where the focal length is in doubt the gyroscope's scale is fixed: without rotation about the optical axis they look alike.
const std::vector<ChangeGroup>& groups_without_scale() {
  static const std::vector<ChangeGroup> all = [] {
    std::vector<ChangeGroup> made = groups();
    std::erase_if(made, [](const ChangeGroup& group) { return group.kind == FindingKind::gyro_scale; });
    return made;
  }();
  return all;
}
/// What fit_gyro says.
bool of_gyro_fit(FindingKind kind) {
  return kind == FindingKind::time_offset || kind == FindingKind::rolling_shutter || kind == FindingKind::imu_camera_rotation;
}
constexpr double kSignificant = 5;
constexpr int kRounds = 5;
constexpr std::size_t kFewestPairs = 30;
const std::vector<int> kAlwaysFree{kBias, kBias + 1, kBias + 2};
/// Reported with their standard deviations, whether they are changes or not.
const std::vector<int> kAlwaysSaid{kTime, kRotation, kRotation + 1, kRotation + 2};
const std::vector<int> kFocalAlone{kFocal};

struct FoundChange {
  const ChangeGroup* group;
  double explained_px;
};

/// Estimates the group of unknowns that reduces the error most, then the next, as long as the reduction is significant.
std::vector<FoundChange> search(MotionProblem& problem, const MotionStart& start) {
  std::vector<FoundChange> found;
  double capped = problem.capped_error();
  for (int round = 0; round < kRounds; ++round) {
    auto best = best_candidate(problem, start.focal_doubted ? groups_without_scale() : groups());
    if (!best || !(best->error_px < capped)) break;
    const Amount amount = amount_of(*best->group, best->fit, best->solution);
    if (amount.sigmas() <= kSignificant) break;
    const bool said = !start.gyro_known || !of_gyro_fit(best->group->kind);
    if (said && amount.value.norm() > best->group->practical)
      found.push_back({best->group, explained_px(capped, best->error_px)});
    capped = best->error_px;
    problem = std::move(best->fit);
  }
  return found;
}

}  // namespace

double prediction_error_px(const std::vector<FramePair>& pairs, const ImuSeries& imu, const MotionStart& start) {
  MotionProblem problem(pairs, imu, start);
  problem.free = kAlwaysFree;
  if (problem.pairs() >= kFewestPairs) problem.converge();
  return problem.typical_error();
}

MotionFit fit_motion(const std::vector<FramePair>& pairs, const ImuSeries& imu, const MotionStart& start) {
  MotionFit fit;
  MotionProblem problem(pairs, imu, start);
  if (problem.pairs() < kFewestPairs) return fit;
  problem.free = kAlwaysFree;
  if (!problem.converge()) return fit;
  fit.usable = true;
  fit.error_px = problem.typical_error();
  const std::vector<FoundChange> found = search(problem, start);
  problem.free = with(with(kAlwaysSaid, kAlwaysFree), problem.free);
  if (start.focal_doubted) problem.free = with(problem.free, kFocalAlone);
  const auto last = problem.converge();
  if (!last) return fit;
  // The last solution has all changes in it: those found early are estimated better together with the later ones.
  for (const auto& [group, explained] : found) {
    const Amount amount = amount_of(*group, problem, *last);
    const int axis = group->unknowns.front() - kAxis;
    fit.changes.push_back({group->kind, amount.value, amount.covariance, explained, axis >= 0 && axis < 3 ? axis : -1});
  }
  const Hypothesis at = problem.hypothesis();
  fit.remaining_px = problem.typical_error();
  fit.R_CB = at.R_CB, fit.offset_s = start.offset_s + problem.x(kTime), fit.gyro_bias_radps = at.bias;
  const Eigen::VectorXd sigma = last->covariance.diagonal().cwiseSqrt();
  fit.offset_sigma_s = sigma(0);
  fit.rotation_sigma_rad = sigma.segment<3>(1);
  fit.gyro_bias_sigma_radps = sigma.segment<3>(4);
  if (!start.focal_doubted) return fit;
  const auto place = std::find(problem.free.begin(), problem.free.end(), +kFocal) - problem.free.begin();
  fit.log_focal = problem.x(kFocal), fit.log_focal_sigma = sigma(place);
  return fit;
}

}  // namespace fbvins
