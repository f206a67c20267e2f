// SPDX-License-Identifier: Apache-2.0
// What became of the sensors' input: what was taken and what was refused, and why.
#pragma once

namespace fbvins {

struct ImuBufferCounts {
  int accepted = 0;
  int duplicate = 0;  ///< same stamp as the one before
  int backward = 0;   ///< earlier stamp than the one before, or than the last extraction
  int invalid = 0;    ///< NaN, infinite or beyond any sensor's range
  int overflow = 0;   ///< dropped from a full buffer before they were extracted
};

struct InputCounts {
  ImuBufferCounts imu;
  int images = 0;
  int images_backward = 0;  ///< stamp not after the image before: skipped
};

}  // namespace fbvins
