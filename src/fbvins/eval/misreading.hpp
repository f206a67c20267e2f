// SPDX-License-Identifier: Apache-2.0
// Private: what a trajectory's file does not say, but a comparison with the truth shows: quaternions in the other order or
// conjugated, positions in millimetres. Pure function, any thread.
//
//   const Misreading found = find_misreading(truth, estimate, {});
//   if (!found.said.empty()) note(found.said), estimate = found.estimate;
#pragma once

#include <string>

#include "fbvins/eval/association.hpp"

namespace fbvins {

struct Misreading {
  AnyTrajectory estimate;  ///< as it is meant
  std::string said;        ///< what was found, for people; empty where nothing was
};

/// Something is found only where it explains nearly all of a large error: orientations that are off by more than 15 degrees and
/// then by less than a fifth of it, a scale within 3 % of a thousand.
Misreading find_misreading(const AnyTrajectory& truth, const AnyTrajectory& estimate, const AssociationOptions& options);

}  // namespace fbvins
