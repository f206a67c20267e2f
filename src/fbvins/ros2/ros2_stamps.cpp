// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_stamps.hpp"

#include <ctime>

#include "fbvins/io/ros_messages.hpp"

namespace fbvins {
namespace {

/// How much CLOCK_REALTIME is ahead of CLOCK_MONOTONIC now: somebody may set the one.
Duration realtime_ahead() {
  timespec real{}, monotonic{};
  clock_gettime(CLOCK_REALTIME, &real);
  clock_gettime(CLOCK_MONOTONIC, &monotonic);
  return Duration{(real.tv_sec - monotonic.tv_sec) * 1'000'000'000LL + (real.tv_nsec - monotonic.tv_nsec)};
}

}  // namespace

void Ros2Stamps::compare(Time sensors, Time host) {
  ahead_ = of(sensors, host) - sensors;
  compared_ = true;
}

bool Ros2Stamps::known(Time sensors) const {
  const Time t = of(sensors);
  return (compared_ || clock_ == Ros2Clock::sensors) && t.ns >= 0 && t < ros_time_end();
}

Time Ros2Stamps::of(Time sensors, Time host) const { return clock_ == Ros2Clock::sensors ? sensors : host + realtime_ahead(); }

}  // namespace fbvins
