// SPDX-License-Identifier: Apache-2.0
// Gathers what speaks against a frame, and remembers what was seen before it; decide_health() (health_decision.hpp) says what
// that means. One owner, one thread.
#pragma once

#include <optional>

#include "fbvins/core/sample_period.hpp"
#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/health_decision.hpp"
#include "fbvins/imu/nav_state.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

class HealthJudge {
 public:
  /// `stereo`: some of the rig's cameras see the same things.
  explicit HealthJudge(const EstimatorOptions& options, int cameras = 2, bool stereo = true)
      : options_(options), cameras_(cameras), stereo_(stereo) {}

  /// A window starts.
  void start() { seen_sigma_m_ = 0; }
  /// What speaks against a frame, beside the frame itself.
  struct Evidence {
    double worst_sigma_m = 0;  ///< of the position
    int failed_solves = 0;
    int broken_features = 0;  ///< that were left out
    bool contradiction = false;
    bool unrecoverable = false;      ///< and the estimate cannot recover from it
    std::uint8_t wrong_cameras = 0;  ///< bits, as in Health; they contradict the others and the readings
    bool after_gap = false;          ///< of the readings
    bool after_dark = false;         ///< and the velocity is being found again
    bool clipped = false;
    HealthReason doubted_sensor = HealthReason::none;  ///< that is left out
    double gyro_vibration_radps = 0;
  };
  /// Health at a frame in the window, after its solve.
  Health judge(const TrackedFrame& frame, const NavState<G>& state, int landmarks_in_view, const Evidence& evidence);
  /// Health at a frame before the start; `reason` is what the initialiser waits for.
  Health before_start(const TrackedFrame& frame, HealthReason reason);
  /// And of the frame that was judged last, when more is known of it.
  Health contradicted();
  Health start_refused();
  Health corrected(HealthEvidence::Correction correction);
  /// To be called after each frame, whether it was judged or not.
  void pass(const TrackedFrame& frame);

 private:
  Health decide() const;
  bool images_missing(const TrackedFrame& frame) const;
  std::uint8_t missing_cameras(const TrackedFrame& frame) const;

  EstimatorOptions options_;
  HealthEvidence evidence_;  ///< of the newest frame
  int cameras_;
  bool stereo_;
  std::optional<Time> previous_image_;
  double seen_sigma_m_ = 0;  ///< of the last frame with enough landmarks
  SamplePeriod image_period_;
};

}  // namespace fbvins
