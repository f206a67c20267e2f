// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/stereo_fit.hpp"

#include <algorithm>

#include "fbvins/core/median.hpp"
#include "fbvins/doctor/change_search.hpp"
#include "fbvins/doctor/stereo_problem.hpp"

namespace fbvins {
namespace {

using namespace doctor::stereo;

/// A change must explain this much of the epipolar error (root mean square): half of the accuracy of a feature.
constexpr double kPractical_px = 0.3;
/// And be larger than this many of its standard deviations.
constexpr double kSignificant = 5;
constexpr int kMostChanges = 3;
constexpr std::size_t kFewestMatches = 150, kMostMatches = 3000;

const std::vector<ChangeGroup>& groups() {
  static const std::vector<ChangeGroup> all = [] {
    std::vector<ChangeGroup> made{{FindingKind::right_camera_turned, WhichLens::right, {kTurn, kTurn + 1, kTurn + 2}, 0},
                                  {FindingKind::baseline_direction, WhichLens::right, {kBaseline, kBaseline + 1}, 0},
                                  {FindingKind::stereo_sync, WhichLens::right, {kDelay}, 0}};
    for (const auto& [lens, first] :
         {std::pair{WhichLens::left, +kLeft}, {WhichLens::right, +kRight}, {WhichLens::both, +kBoth}}) {
      made.push_back({FindingKind::focal_length, lens, {first + kFocal}, 0});
      made.push_back({FindingKind::principal_point, lens, {first + kCentre, first + kCentre + 1}, 0});
      made.push_back({FindingKind::distortion, lens, {first + kRadial, first + kRadial + 1}, 0});
    }
    return made;
  }();
  return all;
}

bool is_common_focal(const ChangeGroup& group) {
  return group.kind == FindingKind::focal_length && group.lens == WhichLens::both;
}
const std::vector<ChangeGroup>& groups_without_common_focal() {
  static const std::vector<ChangeGroup> all = [] {
    std::vector<ChangeGroup> made = groups();
    std::erase_if(made, is_common_focal);
    return made;
  }();
  return all;
}

std::vector<Match> thinned(std::vector<Match> matches) {
  const std::size_t step = (matches.size() + kMostMatches - 1) / kMostMatches;
  if (step <= 1) return matches;
  std::vector<Match> kept;
  for (std::size_t i = 0; i < matches.size(); i += step) kept.push_back(matches[i]);
  return kept;
}

RegionErrors by_region(std::span<const Match> matches, const Hypothesis& at, const Camera& left) {
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

StereoRig corrected(const StereoRig& rig, const Hypothesis& at) {
  StereoRig out = rig;
  out.cameras[0].camera = at.left, out.cameras[1].camera = at.right;
  const Pose<C1, C0> T_C1C0{at.R, rig.T_C1C0().p.norm() * at.t};
  out.cameras[1].T_BC = (rig.T_BC0() * T_C1C0.inverse()).cast_frames<B, C0>();
  return out;
}

}  // namespace

double epipolar_error_px(const StereoView& view, const StereoRig& rig) {
  return typical_error_px(collect({&view, 1}, rig, nullptr, {}), Hypothesis(rig, Eigen::VectorXd::Zero(kUnknowns)));
}

StereoFit fit_stereo(std::span<const StereoView> views, const StereoRig& rig, const ImuSeries* imu,
                     std::span<const FramePair> pairs, bool focal_known) {
  StereoFit fit;
  fit.rig = rig;
  const std::vector<Match> matches = thinned(collect(views, rig, imu, pairs));
  fit.matches = static_cast<int>(matches.size());
  if (matches.size() < kFewestMatches) return fit;
  StereoProblem problem(matches, rig);
  fit.error_px = typical_error_px(matches, problem.hypothesis());
  fit.regions = by_region(matches, problem.hypothesis(), rig.left());
  double capped = problem.capped_error();
  while (fit.changes.size() < kMostChanges) {
    auto best = best_candidate(problem, focal_known ? groups_without_common_focal() : groups());
    if (!best) break;
    const double explained = explained_px(capped, best->error_px);
    const Amount amount = amount_of(*best->group, best->fit, best->solution);
    if (explained < kPractical_px || amount.sigmas() < kSignificant) break;
    fit.changes.push_back({best->group->kind, best->group->lens, amount.value, amount.covariance, explained});
    capped = best->error_px;
    problem = std::move(best->fit);
    // The effect of a late image is modelled to first order only: what is left of it looks like other changes.
    if (best->group->kind == FindingKind::stereo_sync) break;
  }
  const Hypothesis after = problem.hypothesis();
  fit.remaining_px = typical_error_px(matches, after);
  fit.remaining = by_region(matches, after, rig.left());
  fit.rig = corrected(rig, after);
  return fit;
}

}  // namespace fbvins
