// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/thinning.hpp"

#include <algorithm>
#include <limits>

#include "fbvins/core/angle.hpp"
#include "fbvins/loop/map_edges.hpp"

namespace fbvins {
namespace {

/// The newest keyframes are where the flight is: they stay.
constexpr std::size_t kKeepNewest = 20;
/// A place recognised from so near, and from so near a direction, adds nothing.
constexpr double kRedundant_m = 0.20, kRedundant_rad = 12 * kDegree;

/// Of `max_keyframes`, which a flight may have in a map that is full.
constexpr int kShareOfAFlight = 5;

/// The one whose neighbours in time are nearest to one another (m and rad together) adds least. Never the first, which
/// defines M, and none of the first `kept`.
KeyframeId least_of(const std::vector<MapKeyframe>& k, std::size_t kept) {
  std::size_t least = std::max<std::size_t>(1, kept);
  double smallest = std::numeric_limits<double>::max();
  for (std::size_t i = least; i + kKeepNewest < k.size(); ++i) {
    const double gap = (k[i + 1].T_MB.p - k[i - 1].T_MB.p).norm() + angle_between(k[i + 1].T_MB.q, k[i - 1].T_MB.q);
    if (gap < smallest) smallest = gap, least = i;
  }
  return k[least].id;
}

}  // namespace

Thinning::Thinning(int thin_above, int max_keyframes, const PlaceMap& map)
    : thin_above_(thin_above), max_keyframes_(max_keyframes), loaded_(map.size()) {}

void Thinning::note(KeyframeId id, std::span<const MapEdge> loops, std::size_t size) {
  const double scale = std::max(1.0, static_cast<double>(size) / thin_above_);
  const bool redundant = std::any_of(loops.begin(), loops.end(), [&](const MapEdge& e) {
    return e.T_from_to.p.norm() < scale * kRedundant_m && angle_between(e.T_from_to.q, Quat::Identity()) < scale * kRedundant_rad;
  });
  if (redundant) redundant_.push_back(id);
}

std::optional<KeyframeId> Thinning::next(const PlaceMap& map) {
  const auto size = static_cast<int>(map.size());
  while (size > thin_above_ && map.size() > kKeepNewest && !redundant_.empty() &&
         redundant_.front() < map.keyframes()[map.size() - kKeepNewest].id) {
    const KeyframeId id = redundant_.front();
    redundant_.erase(redundant_.begin());
    if (map.find(id) != nullptr) return id;
  }
  const int own = size - static_cast<int>(loaded_);
  const int most_own = std::max(max_keyframes_ - static_cast<int>(loaded_), loaded_ > 0 ? max_keyframes_ / kShareOfAFlight : 0);
  if (own > most_own && size > 2) return least_of(map.keyframes(), loaded_);
  return std::nullopt;
}

const MapKeyframe* successor_of(const PlaceMap& map, const MapKeyframe& gone) {
  const auto& all = map.keyframes();
  const auto at = static_cast<std::size_t>(&gone - all.data());
  if (at > 0 && all[at - 1].session == gone.session) return &all[at - 1];
  if (at + 1 < all.size() && all[at + 1].session == gone.session) return &all[at + 1];
  for (std::size_t i = at; gone.placed && i-- > 0;)
    if (all[i].placed) return &all[i];
  return nullptr;
}

}  // namespace fbvins
