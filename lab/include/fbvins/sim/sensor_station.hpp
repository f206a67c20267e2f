// SPDX-License-Identifier: Apache-2.0
// World, cameras and IMU of a simulation step by step, for a controller that decides in flight where to go. The same models as
// in `simulate`, but the IMU vibrates with the vehicle's own rotors. The same calls give the same bits.
//
//   Result<SensorStation> station = SensorStation::create(options, plan, path);
//   ImuSample reading = station->read_imu(motion, rotor_radps / hover_radps);
//   if (t_s >= station->next_image_s() + station->longest_exposure_s()) frame = station->render(motion_at);
//
// Times are seconds from start(). Threads: one owner; rendering takes one more.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "fbvins/sim/simulation.hpp"

namespace fbvins {

class SensorStation {
 public:
  /// `plan`: the rooms; `path`: the vehicle's path, which is kept clear. Options of flights are not used.
  static Result<SensorStation> create(const SimulationOptions& options, const FloorPlan& plan, const std::vector<Vec3>& path);
  ~SensorStation();
  SensorStation(SensorStation&&) noexcept;
  SensorStation& operator=(SensorStation&&) noexcept;

  const StereoRig& rig() const;
  const World& world() const;
  Time start() const;

  /// The next reading, at rig().imu_noise.rate_hz, the first at 0. `rotors`: speeds over those in hover.
  ImuSample read_imu(const MotionState& motion, const std::array<double, 4>& rotors);
  /// The true state at the last reading.
  TrueState truth() const;

  /// Time of the next image (the middle of its exposure); where frames are lost intervals are longer.
  double next_image_s() const;
  /// Upper bound of an exposure: render() calls `motion` within this of the image's time (global shutter).
  double longest_exposure_s() const;
  /// Renders the image of next_image_s(). `motion`: the body's, over the whole exposure. Stamps on the cameras' clock.
  RenderedFrame render(const std::function<MotionState(double t_s)>& motion);

 private:
  struct Impl;
  explicit SensorStation(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fbvins
