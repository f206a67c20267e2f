// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

Time& stamp_of(SensorEvent& event) {
  return std::visit(
      Overloaded{[](AidingSample& reading) -> Time& { return stamp_of(reading); }, [](auto& e) -> Time& { return e.t; }}, event);
}

Time stamp_of(const SensorEvent& event) {
  return std::visit(Overloaded{[](const AidingSample& reading) { return stamp_of(reading); }, [](const auto& e) { return e.t; }},
                    event);
}

}  // namespace fbvins
