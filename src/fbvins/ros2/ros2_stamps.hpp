// SPDX-License-Identifier: Apache-2.0
// Stamps of ROS 2's messages: on the sensors' clock, or on ROS's, to which that is compared at every pose. One thread.
//
//   stamps.compare(pose.t, pose.host_t);
//   if (stamps.known(t)) append_image(out, stamps.of(t), ...);
#pragma once

#include "fbvins/core/time.hpp"
#include "fbvins/live/ros2_options.hpp"

namespace fbvins {

class Ros2Stamps {
 public:
  explicit Ros2Stamps(Ros2Clock clock) : clock_(clock) {}

  /// The same moment on the sensors' clock and on this machine's CLOCK_MONOTONIC.
  void compare(Time sensors, Time host);
  /// Whether a stamp can be made: there was a comparison where one is needed, and ROS's seconds reach so far.
  bool known(Time sensors) const;
  Time of(Time sensors) const { return sensors + ahead_; }
  /// Of a moment that is known on both clocks.
  Time of(Time sensors, Time host) const;

 private:
  Ros2Clock clock_;
  bool compared_ = false;
  Duration ahead_;  ///< of the messages' time before the sensors'
};

}  // namespace fbvins
