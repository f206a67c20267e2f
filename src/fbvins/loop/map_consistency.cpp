// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_consistency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace fbvins {
namespace {

/// Squared residual from which a loop contradicts the poses: where the graph gives it less than a tenth of its weight.
constexpr double kContradicts = 34.6;
/// Loops, and keyframes that have some, without which it is not certain where a part lies.
constexpr int kLeastTies = 3;
/// Steps of the odometry may differ from the poses by twice their standard deviation; measurements that fit to their noise need
/// not fit as well as before; beyond that a factor of the value before.
constexpr double kStepsFit = 4, kRestFits = 1, kWorse = 1.3;
constexpr double kRows = 6;
/// In standard deviations, of a flight of one camera.
constexpr double kScaleFits = 5;

}  // namespace

PartFit fit_of(const PlaceMap& map, const InPart& in_part) {
  PartFit fit;
  const std::vector<double> chi2 = map.chi2_of_edges({});
  std::set<KeyframeId> tied;
  double steps = 0, rest = 0;
  int steps_count = 0, rest_count = 0;
  for (std::size_t i = 0; i < map.edges.size(); ++i) {
    const MapEdge& e = map.edges[i];
    const bool a = in_part(map.find(e.from)->session), b = in_part(map.find(e.to)->session);
    const bool loop = e.kind == MapEdge::Kind::loop, fits = !loop || chi2[i] < kContradicts;
    if (a != b && fits) ++fit.ties, tied.insert(a ? e.from : e.to);
    if (a != b && !fits) ++fit.contradicting;
    if (a && b && !loop) steps += chi2[i], ++steps_count;
    if (!a && !b && fits) rest += chi2[i], ++rest_count;
  }
  fit.tied_keyframes = static_cast<int>(tied.size());
  fit.steps = steps / (kRows * std::max(1, steps_count));
  fit.rest = rest / (kRows * std::max(1, rest_count));
  for (const MapSession& s : map.sessions)
    if (in_part(s.number) && s.scale_sigma > 0) fit.scale = std::max(fit.scale, std::abs(s.log_scale) / s.scale_sigma);
  fit.anchored = map.anchored &&
                 std::ranges::any_of(map.anchors, [&](const MapAnchor& a) { return in_part(map.find(a.keyframe)->session); });
  return fit;
}

std::string objection(const PartFit& before, const PartFit& after, int refused) {
  if (!after.anchored && std::min(after.ties, after.tied_keyframes) < kLeastTies)
    return fmt::format("{} of its keyframes show known places, {} are needed", after.tied_keyframes, kLeastTies);
  const int wrong = after.contradicting + refused;
  if (wrong > after.ties && !after.anchored)
    return fmt::format("{} of {} recognised places contradict it", wrong, wrong + after.ties);
  if (after.steps > std::max(kStepsFit, kWorse * before.steps))
    return fmt::format("its odometry does not fit the places it recognised: {:.1f} squared standard deviations of a step",
                       after.steps);
  if (after.scale > kScaleFits)
    return fmt::format("its scale does not fit the places it recognised: it is off by {:.1f} standard deviations", after.scale);
  if (after.rest > std::max(kRestFits, kWorse * before.rest))
    return fmt::format("it bends the map: its measurements fit worse than before, {:.2f} -> {:.2f} squared standard deviations",
                       before.rest, after.rest);
  return {};
}

}  // namespace fbvins
