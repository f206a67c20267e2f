// SPDX-License-Identifier: Apache-2.0
// The one place where health is decided: what is known of a frame, and a written order of precedence. Causes come before their
// symptoms: an image that did not come is `no_images`, not `no_tracks`. Pure function.
//
//   const Health health = decide_health({.landmarks_in_view = 80, .contradiction = true});
#pragma once

#include <cstdint>
#include <optional>

#include "fbvins/types/odometry.hpp"

namespace fbvins {

/// Of one frame, as HealthJudge and the estimator collect it. The defaults are those of a good one.
struct HealthEvidence {
  bool start_refused = false;
  std::optional<HealthReason> waiting_for = {};  ///< there is no window yet: for what

  // Images
  bool without_images = false;       ///< none came for this frame
  bool images_missing = false;       ///< or none before it, for a while
  std::uint8_t missing_cameras = 0;  ///< bits, as in Health
  int broken_features = 0;           ///< that were left out
  int landmarks_in_view = 1;
  bool few_tracks = false;
  double blind_m = 0;  ///< by which the position's standard deviation has grown since there were enough
  bool no_pair_sees = false;
  bool after_dark = false;  ///< and the velocity is being found again

  // Readings
  bool no_readings = false;
  double longest_gap_s = 0;
  bool after_gap = false;
  bool clipped = false;
  double gyro_vibration_radps = 0;

  // The estimate
  bool finite = true;
  int failed_solves = 0;
  double speed_mps = 0, gyro_bias_radps = 0, accel_bias_mps2 = 0;

  // What contradicts it
  bool contradiction = false;
  bool unrecoverable = false;                        ///< and the estimate cannot recover from it
  std::uint8_t wrong_cameras = 0;                    ///< bits, as in Health; they contradict the others and the readings
  HealthReason doubted_sensor = HealthReason::none;  ///< another one that contradicts them and is left out
  enum class Correction { none, pending, made } correction = Correction::none;  ///< made: at once, after trouble
};

/// Beyond these an estimate is lost.
struct HealthLimits {
  double blind_m = 0.5, speed_mps = 30, readings_gap_s = 1;
};

Health decide_health(const HealthEvidence& evidence, const HealthLimits& limits = {});

}  // namespace fbvins
