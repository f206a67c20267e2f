// SPDX-License-Identifier: Apache-2.0
// What became of the sensors' input: what was taken and what was refused, and why.
#pragma once

namespace fbvins {

struct ImuCounts {
  int accepted = 0;
  int duplicate = 0;  ///< same stamp as the one before
  int backward = 0;   ///< earlier stamp than the one before
  int invalid = 0;    ///< NaN, infinite or beyond the sensor's range
  int repeated = 0;   ///< the same numbers again and again: a sensor that hangs
  int overflow = 0;   ///< dropped before they were used, because no image came for long
};

struct InputCounts {
  ImuCounts imu;
  int images = 0;
  int images_backward = 0;  ///< stamp not after the image before: skipped
  int images_repeated = 0;  ///< of all cameras, the same as an earlier one though the vehicle has turned: left out
};

}  // namespace fbvins
