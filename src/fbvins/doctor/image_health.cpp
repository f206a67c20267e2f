// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/image_health.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "fbvins/checkup/projector_dots.hpp"

namespace fbvins {
namespace {

/// A single repeated image may be a driver's substitute for a lost one; a share of them is a fault.
constexpr double kMostRepeated = 0.005;
constexpr double kMostSamePair = 0.1;

void check_camera(int repeated, int frames, const char* camera, std::vector<Finding>& findings) {
  if (repeated < 2 || repeated < kMostRepeated * frames) return;
  Finding finding;
  finding.kind = FindingKind::frozen_images;
  finding.size = repeated, finding.unit = "images";
  finding.measured = fmt::format("{} of {} {} images are the one before, to the last bit", repeated, frames, camera);
  finding.expected = "no two images of a camera are the same";
  finding.advice =
      "the camera hangs or the driver repeats images under new stamps: look at cable and USB bandwidth, and drop what is repeated";
  findings.push_back(std::move(finding));
}

}  // namespace

std::vector<Finding> check_repeated(const RepeatedImages& repeated) {
  std::vector<Finding> findings;
  check_camera(repeated.left, repeated.frames, "left", findings);
  check_camera(repeated.right, repeated.frames, "right", findings);
  if (repeated.same_pair > kMostSamePair * repeated.frames) {
    Finding finding;
    finding.kind = FindingKind::same_image_twice;
    finding.size = repeated.same_pair, finding.unit = "images";
    finding.measured = fmt::format("in {} of {} stereo images left and right are one image, to the last bit", repeated.same_pair,
                                   repeated.frames);
    finding.expected = "two cameras";
    finding.advice = "one topic or folder is named for both cameras";
    findings.push_back(std::move(finding));
  }
  return findings;
}

namespace {

/// Images are compared that are this far apart, or closer if features move a lot: fast ones are not tracked for long.
constexpr double kApart_s = 0.5, kOthersMove_px = 5, kOthersMoveALot_px = 10, kStays_px = 0.6;
/// Least share of the features that must move; where the gyroscope says that the rig rotated by kTurned_px a least number is
/// enough: then the whole scene moves in the image, and not only things that move in the scene.
constexpr double kLeastMoving = 0.25, kTurned_px = 20;
constexpr std::size_t kFewestMoving = 8, kFewestFeatures = 20;
constexpr double kMostFixed = 0.15;
constexpr int kFewestPairs = 8;

struct Moved {
  std::int64_t id;
  double px;
};

/// Motions of the features perpendicular to the baseline, along which a projector's spots move with the depth of the scene.
/// Without a baseline, `across` of zero, along any direction.
std::vector<Moved> motions_across(const SeenFrame& a, const SeenFrame& b, const Vec2& across) {
  std::vector<Moved> out;
  auto there = b.features.begin();
  for (const SeenFeature& feature : a.features) {
    while (there != b.features.end() && there->id < feature.id) ++there;
    if (there != b.features.end() && there->id == feature.id)
      out.push_back(
          {feature.id, across.isZero() ? (there->px - feature.px).norm() : std::abs((there->px - feature.px).dot(across))});
  }
  return out;
}

bool others_move(const std::vector<Moved>& motions, double least_px, double turned_px) {
  const auto moving =
      static_cast<std::size_t>(std::count_if(motions.begin(), motions.end(), [&](const Moved& m) { return m.px > least_px; }));
  if (motions.size() < kFewestFeatures || moving < kFewestMoving) return false;
  return turned_px > kTurned_px || static_cast<double>(moving) > kLeastMoving * static_cast<double>(motions.size());
}

/// Pairs of images in which a feature stayed, and in which it moved.
struct Stays {
  int stayed = 0, moved = 0;
  /// Twice at least: near the focus of expansion a feature of the scene stays for a moment, too.
  bool fixed() const { return stayed >= 2 && stayed > 9 * moved; }
};

FixedFeatures sum_up(const std::map<std::int64_t, Stays>& features, int pairs) {
  FixedFeatures out;
  out.pairs = pairs;
  double fixed = 0, all = 0;
  for (const auto& [id, stays] : features) {
    all += stays.stayed + stays.moved;
    if (!stays.fixed()) continue;
    fixed += stays.stayed;
    out.ids.insert(id);
  }
  out.share = fixed / std::max(all, 1.0);
  return out;
}

double share_of_dots(const Evidence& evidence) {
  double dots = 0, features = 0;
  for (const SeenFrame& frame : evidence.frames)
    for (const SeenFeature& feature : frame.features) dots += feature.bright_dot, features += 1;
  return dots / std::max(features, 1.0);
}

}  // namespace

FixedFeatures measure_fixed(const Evidence& evidence, const ImuSeries& imu) {
  const Vec3 baseline = evidence.rig.has_right() ? evidence.rig.T_C1C0().p.normalized() : Vec3::Zero();
  const Vec2 across = Vec2(-baseline.y(), baseline.x()).normalized();
  const double focal_px = evidence.rig.left().focal_px();
  std::map<std::int64_t, Stays> features;
  int pairs = 0;
  std::size_t a = 0;
  for (std::size_t b = 0; b < evidence.frames.size(); ++b) {
    const SeenFrame &first = evidence.frames[a], &second = evidence.frames[b];
    const bool far = (second.t - first.t).seconds() > kApart_s;
    const std::vector<Moved> motions = motions_across(first, second, across);
    const double turned_px = imu.covers(first.t, second.t) ? focal_px * imu.turned(first.t, second.t).norm() : 0;
    const bool tells = others_move(motions, far ? kOthersMove_px : kOthersMoveALot_px, turned_px);
    if (far || tells) a = b;
    if (!tells) continue;
    ++pairs;
    for (const Moved& m : motions) ++(m.px < kStays_px ? features[m.id].stayed : features[m.id].moved);
  }
  FixedFeatures out = sum_up(features, pairs);
  out.dots = share_of_dots(evidence);
  return out;
}

std::optional<Finding> check_fixed(const FixedFeatures& fixed) {
  if (auto dots = check_dots(fixed.dots)) return dots;
  if (fixed.pairs < kFewestPairs || fixed.share < kMostFixed) return std::nullopt;
  Finding finding;
  finding.kind = FindingKind::fixed_in_view;
  finding.size = fixed.share, finding.unit = "of the features";
  finding.measured =
      fmt::format("{:.0f} % of the features stay where they are in the image while the others move", 100 * fixed.share);
  finding.expected = "few";
  finding.advice = "something of the vehicle is in view, or on the lens: move the camera, or clean it";
  return finding;
}

}  // namespace fbvins
