// SPDX-License-Identifier: Apache-2.0
// What a recording or a live sensor delivers, one at a time and in order of time. Code for every event visits it
// (core/overloaded.hpp), so that it does not compile until it handles a new kind of sensor.
#pragma once

#include <variant>

#include "fbvins/core/overloaded.hpp"
#include "fbvins/types/aiding.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

using SensorEvent = std::variant<ImuSample, StereoFrame, AidingSample>;

inline Time& stamp_of(SensorEvent& event) {
  return std::visit(
      Overloaded{[](AidingSample& reading) -> Time& { return stamp_of(reading); }, [](auto& e) -> Time& { return e.t; }}, event);
}
inline Time stamp_of(const SensorEvent& event) {
  return std::visit(Overloaded{[](const AidingSample& reading) { return stamp_of(reading); }, [](const auto& e) { return e.t; }},
                    event);
}

}  // namespace fbvins
