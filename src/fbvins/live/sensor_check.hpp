// SPDX-License-Identifier: Apache-2.0
// Checks live sensors before a flight: rates, gaps, clocks, units, image sizes. Nothing is estimated.
//
//   SensorCheck check(source.rig(), source.clock_rate());
//   source.run(check);                                     // for some seconds
//   for (const SensorFinding& f : check.findings()) ...
//
// Threads: as SensorInput, from any.
#pragma once

#include <functional>
#include <mutex>
#include <vector>

#include "fbvins/live/host_clock.hpp"
#include "fbvins/live/source.hpp"
#include "fbvins/pipeline/repeated_images.hpp"

namespace fbvins {

class SensorCheck final : public SensorInput {
 public:
  SensorCheck(const StereoRig& rig, double clock_rate, std::function<Time()> now = host_now)
      : rig_(rig), clock_rate_(clock_rate), now_(std::move(now)), cameras_(static_cast<std::size_t>(rig.camera_count())) {}

  void push(const ImuSample& sample) override;
  void push(StereoFrame frame) override;

  /// Images first, then readings, then clocks.
  std::vector<SensorFinding> findings() const;

 private:
  /// Stamps and arrival times of one sensor's data.
  struct Arrivals {
    std::vector<Time> stamps, host;
    int backwards = 0;
    void add(Time t, Time host_t);
    double span_s() const;
    double period_s() const;  ///< median
    double largest_gap_s() const;
    double delay_s() const;  ///< median of host clock minus stamp
  };
  void check_images(std::vector<SensorFinding>& findings) const;
  void check_readings(std::vector<SensorFinding>& findings) const;
  void check_clocks(std::vector<SensorFinding>& findings) const;

  StereoRig rig_;
  double clock_rate_;
  std::function<Time()> now_;
  mutable std::mutex mutex_;
  Arrivals images_, readings_;
  struct Watched {
    int missing = 0, repeated = 0;          ///< frames without its image, and with one that it has sent before
    int other_width = 0, other_height = 0;  ///< of an image that is not of the calibration's size
    ImageHistory seen = {};
  };
  void check_camera(int number, std::vector<SensorFinding>& findings) const;
  std::vector<Watched> cameras_;
  int without_depth_ = 0;
  double accel_sum_ = 0, gyro_sum_ = 0;  // of magnitudes, m/s^2 and rad/s
};

}  // namespace fbvins
