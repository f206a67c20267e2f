// SPDX-License-Identifier: Apache-2.0
// Shared by rendered recordings and SensorStation. Pure functions unless said otherwise.
#pragma once

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/flight_recorder.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {

inline constexpr Time kSimulationStart{1'700'000'000'000'000'000};  ///< stamp of a synthetic flight's first IMU sample
inline constexpr double kMargin_s = 0.05;                           ///< IMU before the first and after the last image

/// Times of the images since the start, s, without lost frames. One owner.
class FrameTimes {
 public:
  explicit FrameTimes(const SimulationOptions& options);
  double next_s() const { return kMargin_s + static_cast<double>(k_) / rate_hz_; }
  void advance();

 private:
  double rate_hz_, drop_share_;
  Rng rng_;
  std::int64_t k_ = -1;
};

/// Renders the stereo frame at t_s after `start`; frames in order.
RenderedFrame render_at(FlightRecorder& recorder, const StereoRig& rig, double t_s, std::int64_t frame, bool with_depth = false,
                        Time start = kSimulationStart);

}  // namespace fbvins
