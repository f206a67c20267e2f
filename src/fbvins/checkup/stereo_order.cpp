// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/stereo_order.hpp"

#include <fmt/format.h>

#include <array>

#include "fbvins/frontend/either_camera.hpp"
#include "fbvins/frontend/stereo_matches.hpp"

namespace fbvins {
namespace {

constexpr int kFewestMatches = 30;
/// Matches that chance makes along a line are about a tenth of the true ones.
constexpr double kTimesMore = 3;

}  // namespace

bool StereoOrder::swapped() const { return as_swapped >= kFewestMatches && as_swapped > kTimesMore * as_named; }

StereoOrder stereo_order(const StereoRig& rig, std::span<const StereoFrame> frames) {
  const StereoMatches found = count_stereo_matches(std::array{rig, mirrored(rig)}, frames);
  return {found.corners, found.matched[0], found.matched[1]};
}

std::optional<Finding> check_stereo_order(const StereoOrder& order) {
  if (!order.swapped()) return std::nullopt;
  Finding finding;
  finding.kind = FindingKind::swapped_images;
  finding.size = order.as_swapped / static_cast<double>(order.features), finding.unit = "of the features";
  finding.measured = fmt::format("of {} features {} match with the two cameras' images exchanged, and {} as they are named",
                                 order.features, order.as_swapped, order.as_named);
  finding.expected = "a point lies further left in the right image than in the left one";
  finding.advice = "exchange the topics or folders of the cameras, or their entries in the calibration";
  return finding;
}

}  // namespace fbvins
