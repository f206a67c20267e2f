// SPDX-License-Identifier: Apache-2.0
// Processes a recording's images as they come and keeps the evidence that the doctor needs. Of the calibration only the camera
// models are assumed: features are tracked without the IMU, and matched from left to right by descriptor without an epipolar
// line. The first seconds of images are held back until it is known which images are left ones and how the right camera is
// oriented. One thread calls; the same events give the same evidence.
//
//   EvidenceCollector gatherer(rig);
//   while (auto event = data.next()) if (!gatherer.push(*event)) break;      // enough
//   Evidence evidence = gatherer.finish();
#pragma once

#include <memory>

#include "fbvins/doctor/evidence.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

class EvidenceCollector {
 public:
  explicit EvidenceCollector(const StereoRig& rig);
  ~EvidenceCollector();

  /// False once enough has been seen; later events are ignored.
  bool push(const SensorEvent& event);
  Evidence finish();

 private:
  struct State;
  bool push_frame(StereoFrame frame);
  std::unique_ptr<State> state_;
};

}  // namespace fbvins
