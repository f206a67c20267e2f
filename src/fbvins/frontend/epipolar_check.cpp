// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/epipolar_check.hpp"

namespace fbvins {

EpipolarResult EpipolarCheck::ransac(const std::optional<Mat3>& R_now_then, double threshold_px) {
  EpipolarOptions options;
  options.threshold = threshold_px / focal_px_;
  return ransac_epipolar(then_, now_, R_now_then, options, rng_);
}

}  // namespace fbvins
