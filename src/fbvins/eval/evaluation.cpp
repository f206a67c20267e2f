// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/evaluation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace fbvins {

std::vector<double> absolute_errors_m(const std::vector<PosePair>& pairs) {
  std::vector<double> errors;
  errors.reserve(pairs.size());
  for (const PosePair& pair : pairs) errors.push_back((pair.estimate.T.p - pair.truth.T.p).norm());
  return errors;
}

std::vector<double> absolute_errors_deg(const std::vector<PosePair>& pairs) {
  std::vector<double> errors;
  errors.reserve(pairs.size());
  for (const PosePair& pair : pairs) {
    const Quat error = pair.truth.T.q.conjugate() * pair.estimate.T.q;
    errors.push_back(so3_log(error).norm() * 180.0 / std::numbers::pi);
  }
  return errors;
}

namespace {

/// Pairs without a gap between them. A gap is a second, or five times what is usual where pairs are rarer.
std::vector<std::vector<PosePair>> between_gaps(const std::vector<PosePair>& pairs, double gap_s) {
  std::vector<std::vector<PosePair>> out{{pairs.front()}};
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    if ((pairs[i].estimate.t - pairs[i - 1].estimate.t).seconds() > gap_s) out.emplace_back();
    out.back().push_back(pairs[i]);
  }
  return out;
}

double gap_of(const std::vector<PosePair>& pairs) {
  constexpr double kGap_s = 1, kTimesUsual = 5;
  std::vector<double> steps;
  for (std::size_t i = 1; i < pairs.size(); ++i) steps.push_back((pairs[i].estimate.t - pairs[i - 1].estimate.t).seconds());
  if (steps.empty()) return kGap_s;
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  return std::max(kGap_s, kTimesUsual * steps[steps.size() / 2]);
}

/// How much of the estimate's time has truth.
void cover(const AnyTrajectory& estimate, const std::vector<PosePair>& pairs, double gap_s, Evaluation& e) {
  const auto [first, last] =
      std::minmax_element(estimate.poses.begin(), estimate.poses.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
  double missing_s = 0;
  Time before = first->t;
  const auto up_to = [&](Time t) {
    const double step_s = (t - before).seconds();
    before = t;
    if (step_s <= gap_s) return;
    missing_s += step_s;
    e.longest_truth_gap_s = std::max(e.longest_truth_gap_s, step_s);
  };
  for (const PosePair& pair : pairs) up_to(pair.estimate.t);
  up_to(last->t);
  const double span_s = (last->t - first->t).seconds();
  if (span_s > 0) e.truth_share = 1 - missing_s / span_s;
}

/// Aligned by the poses before the first gap, those behind the last one are off by so much in the mean.
std::optional<double> drift_behind(const std::vector<std::vector<PosePair>>& parts) {
  if (parts.size() < 2) return std::nullopt;
  const Result<Similarity> alignment = align(parts.front(), Alignment::se3);
  if (!alignment) return std::nullopt;
  Vec3 off = Vec3::Zero();
  for (const PosePair& pair : apply(*alignment, parts.back())) off += pair.estimate.T.p - pair.truth.T.p;
  return (off / static_cast<double>(parts.back().size())).norm();
}

RelativeErrors relative_errors_of(const std::vector<std::vector<PosePair>>& parts, const RelativeErrorOptions& options) {
  RelativeErrors out;
  for (const std::vector<PosePair>& part : parts) {
    const RelativeErrors errors = relative_errors(part, options);
    out.translation_m.insert(out.translation_m.end(), errors.translation_m.begin(), errors.translation_m.end());
    out.rotation_deg.insert(out.rotation_deg.end(), errors.rotation_deg.begin(), errors.rotation_deg.end());
  }
  return out;
}

/// Relative errors of positions are those along the body's axes, and so need orientations, too.
void add_errors_of_orientations(const std::vector<PosePair>& pairs, const std::vector<std::vector<PosePair>>& parts,
                                const EvaluationOptions& options, Evaluation& e) {
  e.absolute_rotation_deg = statistics_of(absolute_errors_deg(pairs));
  RelativeErrors metre = relative_errors_of(parts, options.per_metre);
  e.per_metre_m = statistics_of(std::move(metre.translation_m));
  e.per_metre_deg = statistics_of(std::move(metre.rotation_deg));
  RelativeErrors second = relative_errors_of(parts, options.per_second);
  e.per_second_m = statistics_of(std::move(second.translation_m));
  e.per_second_deg = statistics_of(std::move(second.rotation_deg));
}

}  // namespace

bool has_orientations(const AnyTrajectory& trajectory) {
  constexpr double kMoves_m = 0.1;
  const auto& poses = trajectory.poses;
  if (poses.empty()) return true;
  const bool none = std::ranges::all_of(poses, [](const auto& pose) { return pose.T.q.vec().isZero(0); });
  return !none || std::ranges::none_of(poses, [&](const auto& pose) { return (pose.T.p - poses.front().T.p).norm() > kMoves_m; });
}

Result<Evaluation> evaluate(const AnyTrajectory& truth, const AnyTrajectory& estimate, const EvaluationOptions& options) {
  if (estimate.poses.empty()) return Error{ErrorCode::invalid_argument, "there is no estimated pose"};
  std::vector<PosePair> pairs = associate(truth, estimate, options.association);
  if (pairs.empty())
    return Error{ErrorCode::invalid_argument,
                 fmt::format("none of the {} estimated poses belongs to one of the {} true poses: do the stamps use "
                             "the same clock?",
                             estimate.poses.size(), truth.poses.size())};
  const Result<Similarity> alignment = align(pairs, options.alignment);
  if (!alignment) return alignment.error();

  Evaluation e;
  e.pairs = static_cast<int>(pairs.size());
  e.alignment = *alignment;
  const double gap_s = gap_of(pairs);
  cover(estimate, pairs, gap_s, e);
  e.end_drift_m = drift_behind(between_gaps(pairs, gap_s));
  pairs = apply(*alignment, std::move(pairs));
  const std::vector<std::vector<PosePair>> parts = between_gaps(pairs, gap_s);
  e.absolute_m = statistics_of(absolute_errors_m(pairs));
  e.orientations = options.orientations;
  if (options.orientations) add_errors_of_orientations(pairs, parts, options, e);
  for (const std::vector<PosePair>& part : parts)
    for (std::size_t i = 1; i < part.size(); ++i) e.truth_path_m += (part[i].truth.T.p - part[i - 1].truth.T.p).norm();
  for (const PosePair& pair : pairs)
    e.largest_excursion_m = std::max(e.largest_excursion_m, (pair.estimate.T.p - pairs.front().estimate.T.p).norm());
  return e;
}

}  // namespace fbvins
