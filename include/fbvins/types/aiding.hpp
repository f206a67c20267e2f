// SPDX-License-Identifier: Apache-2.0
// A reading of one of the sensors that aid images and IMU. What hands readings on does so for all of them alike; what must know
// them apart visits them (core/overloaded.hpp), and does not compile until it handles a new one.
#pragma once

#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "fbvins/types/pressure.hpp"
#include "fbvins/types/range.hpp"
#include "fbvins/types/velocity.hpp"

namespace fbvins {

using AidingSample = std::variant<RangeSample, VelocitySample, PressureSample>;

Time& stamp_of(AidingSample& reading);
Time stamp_of(const AidingSample& reading);
/// What makes a reading unusable, in words; empty: nothing.
std::string impossible(const AidingSample& reading);

/// Those of one sensor, in their order.
template <class Sample>
std::vector<Sample> readings_of(const std::vector<AidingSample>& all) {
  std::vector<Sample> out;
  for (const AidingSample& reading : all)
    if (const auto* of_it = std::get_if<Sample>(&reading)) out.push_back(*of_it);
  return out;
}

}  // namespace fbvins
