// SPDX-License-Identifier: Apache-2.0
// A real ArduPilot (Copter) in place of the autopilot. It gets the same inputs as on a vehicle: its board's IMU and barometer in
// lockstep, and over UDP the odometry and the mission (CompanionController). It returns the motors' pulses. One owner.
#pragma once

#include <memory>

#include "fbvins/flight/ardupilot_process.hpp"
#include "fbvins/flight/companion_controller.hpp"

namespace fbvins {

class ArduPilotController final : public CompanionController {
 public:
  /// The program's folder exists.
  static Result<std::unique_ptr<FlightController>> create(const ControllerProgram& program, const Mission& mission,
                                                          const QuadrotorOptions& vehicle, const StereoRig& rig,
                                                          const Pose<BodyFlu, B>& mounting);

  /// Its main loop runs at half of this rate.
  double board_rate_hz() const override { return 500; }

 private:
  ArduPilotController(std::unique_ptr<ArduPilotProcess> ardupilot, const Link& link, const Mission& mission,
                      const StereoRig& rig);
  Result<void> step(const BoardReading& reading, double t_s) override;

  std::unique_ptr<ArduPilotProcess> ardupilot_;
  double newest_height_m_ = 0;
};

}  // namespace fbvins
