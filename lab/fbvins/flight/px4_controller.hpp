// SPDX-License-Identifier: Apache-2.0
// A real PX4 in place of the autopilot. It gets the same inputs as on a vehicle: its board's IMU and barometer in lockstep
// (HIL_SENSOR), and over UDP the odometry and the mission (CompanionController). It returns the motor commands
// (HIL_ACTUATOR_CONTROLS). One owner.
#pragma once

#include <memory>

#include "fbvins/flight/companion_controller.hpp"
#include "fbvins/flight/px4_process.hpp"

namespace fbvins {

class Px4Controller final : public CompanionController {
 public:
  /// The program's folder exists.
  static Result<std::unique_ptr<FlightController>> create(const ControllerProgram& program, const Mission& mission,
                                                          const ControlOptions& control, const QuadrotorOptions& vehicle,
                                                          const StereoRig& rig, const Pose<BodyFlu, B>& mounting);

  double board_rate_hz() const override { return 250; }  ///< as in PX4's simulators

 private:
  Px4Controller(std::unique_ptr<Px4Process> px4, const Link& link, const Mission& mission, const StereoRig& rig);
  Result<void> step(const BoardReading& reading, double t_s) override;
  bool awake() const override { return px4_->awake(); }

  std::unique_ptr<Px4Process> px4_;
};

}  // namespace fbvins
