// SPDX-License-Identifier: Apache-2.0
// The focal length that two lenses have in common. The stereo pair hardly observes it, the gyroscope does. In the stereo fit its
// error looks like other changes, so that the pair is fitted again with each estimate.
#include "fbvins/doctor/examination.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/doctor/depths.hpp"
#include "fbvins/doctor/lens_change.hpp"

namespace fbvins {
namespace {

using doctor::kSignificant;

constexpr double kPractical = 0.02, kSettled = 1e-3;
constexpr int kRounds = 8;
/// How well a calibrated gyroscope's scale is known.
constexpr double kGyroScale = 0.01;

bool is_common_focal(const StereoChange& change) {
  return change.kind == FindingKind::focal_length && change.lens == WhichLens::both;
}

struct Doubt {
  double log_focal, explained_px;
};

/// From the stereo fit, or from the motion fit, which sees the left lens alone.
std::optional<Doubt> doubt(const std::vector<StereoChange>& by_pair, const MotionFit& by_motion) {
  for (const StereoChange& change : by_pair)
    if (is_common_focal(change)) return Doubt{change.amount(0), change.explained_px};
  for (const MotionChange& change : by_motion.changes)
    if (change.kind == FindingKind::focal_length) return Doubt{change.amount(0), change.explained_px};
  return std::nullopt;
}

StereoRig with_focal(StereoRig rig, double log_focal) {
  for (MountedCamera& mounted : rig.cameras) mounted.camera = changed(mounted.camera, {.log_focal = log_focal});
  return rig;
}

}  // namespace

/// The motion fit with the common focal length that fits it best, where that is in doubt; replaces the findings about the pair.
MotionFit Examination::with_common_focal(MotionFit fit) {
  const auto doubted = pair_.judged && fit.usable ? doubt(pair_.changes, fit) : std::nullopt;
  if (!doubted) return fit;
  double log_focal = doubted->log_focal;
  StereoFit pair;
  MotionFit by_focal;
  std::vector<FramePair> pairs;
  for (int round = 0; round < kRounds; ++round) {
    pair = pair_fit(with_focal(pair_.before, log_focal), true);
    pairs = pair_frames(with_depths_by(pair.rig, evidence_));
    by_focal = fit_motion(pairs, imu_, {pair.rig, offset_s_, true});
    if (!by_focal.log_focal) return fit;
    log_focal += *by_focal.log_focal;
    if (std::abs(*by_focal.log_focal) < kSettled) break;
  }
  // If one lens alone is wrong, the pair shows it: corrected for both, it needs more changes than before.
  const auto others = std::count_if(pair_.changes.begin(), pair_.changes.end(),
                                    [](const StereoChange& change) { return !is_common_focal(change); });
  if (static_cast<std::ptrdiff_t>(pair.changes.size()) > others) return fit;
  pairs_ = std::move(pairs);
  use_common_focal(log_focal, std::hypot(by_focal.log_focal_sigma, kGyroScale), doubted->explained_px, pair);
  return by_focal;
}

void Examination::use_common_focal(double log_focal, double sigma, double explained_px, const StereoFit& pair) {
  out_.findings.resize(pair_.first_finding);
  rig_ = pair_.before;
  if (std::abs(log_focal) > kPractical && std::abs(log_focal) > kSignificant * sigma)
    lens(FindingKind::focal_length, WhichLens::both, Eigen::VectorXd::Constant(1, log_focal), Eigen::VectorXd::Constant(1, sigma),
         explained_px);
  for (const StereoChange& change : pair.changes) stereo_change(change);
}

}  // namespace fbvins
