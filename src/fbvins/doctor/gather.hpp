// SPDX-License-Identifier: Apache-2.0
// Looks at a recording's images as they come and keeps what the doctor asks of them. Nothing of the calibration but the
// cameras' models is assumed: tracks are followed without the IMU, left and right are matched by descriptor without an
// epipolar line. The first seconds of images are held back until they have told which images are left and where the right camera
// looks. One thread calls; the same events give the same evidence.
//
//   EvidenceGatherer gatherer(rig);
//   while (auto event = data.next()) if (!gatherer.push(*event)) break;      // enough
//   Evidence evidence = gatherer.finish();
#pragma once

#include <memory>

#include "fbvins/doctor/evidence.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

class EvidenceGatherer {
 public:
  explicit EvidenceGatherer(const StereoRig& rig);
  ~EvidenceGatherer();

  /// False once enough has been seen; later events are not looked at.
  bool push(const SensorEvent& event);
  Evidence finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace fbvins
