// SPDX-License-Identifier: Apache-2.0
// What a recording or a live sensor delivers, one at a time and in order of time. Who takes all of them visits them (overloaded.hpp),
// so that another kind of sensor is an error of compilation where nobody handles it.
#pragma once

#include <variant>

#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"
#include "fbvins/types/range.hpp"

namespace fbvins {

using SensorEvent = std::variant<ImuSample, StereoFrame, RangeSample>;

}  // namespace fbvins
