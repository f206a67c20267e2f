// SPDX-License-Identifier: Apache-2.0
// The doctor's short form: checks of the first seconds of a recording, without an estimate. Costs a few milliseconds.
// One thread calls.
//
//   FirstSeconds look(rig);
//   while (auto event = data.next()) { look.push(*event); if (look.is_over()) report(look.findings()); ... }
#pragma once

#include <optional>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/checkup/finding.hpp"
#include "fbvins/checkup/stamps.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

class FirstSeconds {
 public:
  /// `ends`: of a recording, whose first seconds do not tell an IMU that began late from a clock.
  explicit FirstSeconds(const StereoRig& rig, const std::optional<StampEnds>& ends = std::nullopt) : rig_(rig), ends_(ends) {}

  void push(const SensorEvent& event);
  /// Enough has been seen; what comes later is ignored.
  bool is_over() const;
  /// Units, stamps, noise figures, a projector's dots, left and right exchanged. Also after a recording shorter than that.
  std::vector<Finding> findings() const;

 private:
  void keep(const StereoFrame& frame);

  StereoRig rig_;
  std::optional<StampEnds> ends_;
  std::vector<ImuSample> samples_;
  std::vector<Time> images_;
  std::vector<StereoFrame> kept_;  ///< a few, spread over the time
};

}  // namespace fbvins
