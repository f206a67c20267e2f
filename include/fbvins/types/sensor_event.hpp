// SPDX-License-Identifier: Apache-2.0
// What a recording or a live sensor delivers, one at a time and in order of time.
#pragma once

#include <variant>

#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

using SensorEvent = std::variant<ImuSample, StereoFrame>;

}  // namespace fbvins
