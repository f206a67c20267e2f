// SPDX-License-Identifier: Apache-2.0
// The flight controller: odometry, IMU and barometer in, four motor commands out. It has no access to the true state. Between
// images the pose is the newest estimate propagated with the IMU, as `fbvins live` gives it to any controller.
// L is the mission's frame: its origin is where the vehicle stands at take-off, x is its heading there, z is up.
//
//   Autopilot autopilot(mission, settings, rig);
//   autopilot.add(odometry);                              // when it becomes known
//   PerRotor commands = autopilot.update(reading);        // every reading
//   log(autopilot.output());
//
// Threads: one owner.
#pragma once

#include <optional>

#include "fbvins/camera/camera.hpp"
#include "fbvins/flight/flight_controller.hpp"
#include "fbvins/flight/guide.hpp"
#include "fbvins/flight/inertial_reference.hpp"
#include "fbvins/flight/mission.hpp"
#include "fbvins/live/pose_propagator.hpp"

namespace fbvins {

class Autopilot final : public FlightController {
 public:
  Autopilot(const Mission& mission, const ControlOptions& options, const StereoRig& rig, const Pose<BodyFlu, B>& mounting);

  void add(const Odometry& odometry) override;
  /// From then on the mission is flown in the map's frame, M.
  void add(const MapUpdate& update) override;
  void add_barometer(double height_m) override { reference_.correct(height_m); }
  Result<void> take(const ImuSample& reading) override {
    update(reading);
    return {};
  }
  /// Commands until the next reading.
  PerRotor update(const ImuSample& reading);

  const PerRotor& commands() const override { return out_.control.commands; }
  const AutopilotOutput& output() const override { return out_; }

 private:
  VehicleEstimate in_local(const LivePose& pose) const;
  void place_local_frame(const LivePose& pose);
  void place_in_local();
  PerRotor act(double dt_s);
  void watch_ground(double dt_s);

  Pose<BodyFlu, B> mounting_;
  double rate_hz_;
  Geofence fence_;
  ControlOptions options_;
  PosePropagator propagator_;
  CascadeController controller_;
  Guide guide_;
  Failsafe failsafe_;
  InertialReference reference_;
  Odometry newest_;  ///< the newest with a pose
  Pose<M, W> T_MW_;
  std::optional<Pose<Local, M>> T_LM_;  ///< heading and position only: both frames are level
  std::optional<Pose<Local, W>> T_LW_;
  std::uint32_t reset_counter_ = 0;
  std::optional<Time> last_t_;
  double spooling_s_ = 0, still_s_ = 0;
  bool on_ground_ = false;
  AutopilotOutput out_;
};

}  // namespace fbvins
