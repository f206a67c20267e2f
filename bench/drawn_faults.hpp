// SPDX-License-Identifier: Apache-2.0
// Faults drawn at random: kind, moment, length and size; the same number is the same fault.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "bench/faulty_tracks.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/faults/sensor_faults.hpp"

namespace fbvins::bench {

inline constexpr double kLateStart = 0.35, kEarlyEnd = 0.75;  ///< of the flight, in which faults begin

/// Even in the logarithm.
inline double between(Rng& rng, double small, double large) { return small * std::pow(large / small, rng.uniform()); }

inline std::vector<FaultName> kinds_of(bool tracks) {
  std::vector<FaultName> out;
  for (const FaultName& name : fault_names())
    if (!tracks || on_tracks({.kind = name.kind, .image = name.image}) != OnTracks::not_on_tracks) out.push_back(name);
  return out;
}

/// The fault of that number, in a flight of that length.
inline std::string drawn(double whole_s, const std::vector<FaultName>& names, std::uint64_t number) {
  Rng rng(number, 5);
  const FaultName& name = names[number % names.size()];
  const double start = rng.uniform(kLateStart, kEarlyEnd) * whole_s;
  const double length = rng.uniform() < 0.1 ? whole_s : between(rng, 0.1, 4);
  std::string text = fmt::format("{}:{:.2f}:{:.2f}", name.name, start, length);
  if (name.unit.empty()) return text;
  const double amount = between(rng, name.small, name.large);
  return text + fmt::format(":{:.4g}", name.both_signs && rng.below(2) ? -amount : amount);
}

}  // namespace fbvins::bench
