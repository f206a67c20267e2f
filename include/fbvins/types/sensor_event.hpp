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

Time& stamp_of(SensorEvent& event);
Time stamp_of(const SensorEvent& event);

}  // namespace fbvins
