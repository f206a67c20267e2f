// SPDX-License-Identifier: Apache-2.0
// When images are taken: at a rate, or at intervals that change with the exposure; and what their stamps are off by. Pure
// functions of options and seed, unless said otherwise.
#pragma once

#include <cstdint>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {

inline constexpr double kMargin_s = 0.05;  ///< IMU before the first and after the last image

/// camera.intervals_ms as seconds, ascending; empty where it is. An error names what is no interval.
Result<std::vector<double>> image_intervals_s(const SimulationOptions& options);

/// The interval that an image at this time has before the next one, s. The intervals must be readable.
class ImageIntervals {
 public:
  explicit ImageIntervals(const SimulationOptions& options);
  double at(double t_s) const;
  /// Of the shortest interval.
  double longer(double t_s) const { return intervals_s_.empty() ? 1 : at(t_s) / intervals_s_.front(); }
  bool even() const { return intervals_s_.empty(); }

 private:
  std::vector<double> intervals_s_;
  double rate_hz_, stays_s_;
  std::uint64_t seed_;
};

/// Times of the images since the start, s, without lost frames. One owner.
class FrameTimes {
 public:
  explicit FrameTimes(const SimulationOptions& options);
  double next_s() const { return next_s_; }
  void advance();

 private:
  void step();

  ImageIntervals intervals_;
  double rate_hz_, drop_share_, next_s_ = kMargin_s;
  Rng rng_;
  std::int64_t k_ = -1;
};

/// Error of the stamps of all images of a frame. Stamps stay in order.
Duration stamp_error(const SimulationOptions& options, std::int64_t frame);

}  // namespace fbvins
