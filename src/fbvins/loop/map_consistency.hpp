// SPDX-License-Identifier: Apache-2.0
// Does a part of a map fit the rest? By the graph's own measurements, at its present poses (docs/derivations/loop.md, Which
// sessions join). Pure functions.
//
//   const PartFit before = fit_of(map, is_new);
//   map.optimise({});
//   std::string why = objection(before, fit_of(map, is_new));     // empty: it fits
#pragma once

#include <functional>
#include <string>

#include "fbvins/loop/place_map.hpp"

namespace fbvins {

/// Whether keyframes of this session are of the part.
using InPart = std::function<bool(std::uint32_t session)>;

struct PartFit {
  int ties = 0;            ///< loops between part and rest that fit
  int tied_keyframes = 0;  ///< keyframes of the part that have one
  int contradicting = 0;   ///< loops between part and rest that do not fit
  bool anchored = false;   ///< the part has anchors in an anchored map
  /// Mean squared residual in standard deviations: of the odometry's steps in the part; of all measurements in the rest that fit.
  double steps = 0, rest = 0;
  double scale = 0;  ///< how far the scale of its flights is off, in its standard deviations
};

PartFit fit_of(const PlaceMap& map, const InPart& in_part);

/// Why the part does not belong to the rest; empty where it does. `before`: without the loops between them. `refused`: places
/// that were recognised in flight and refused, because the odometry contradicts them.
std::string objection(const PartFit& before, const PartFit& after, int refused = 0);

}  // namespace fbvins
