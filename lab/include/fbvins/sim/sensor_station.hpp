// SPDX-License-Identifier: Apache-2.0
// World, cameras and IMU of a simulation that are asked step by step, for a controller that decides in flight where to go. The
// same models as `simulate`, but the rotors that shake the IMU are the vehicle's own. The same questions give the same bits.
//
//   Result<SensorStation> station = SensorStation::create(options, plan, path);
//   ImuSample reading = station->read_imu(t_s, motion, rotor_radps / hover_radps);
//   if (station->image_due(t_s)) frame = station->render(motion_around_t);
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
  /// `plan`: the rooms; `path`: where the vehicle will be, in them: the world keeps clear of it. Options of flights are not used.
  static Result<SensorStation> create(const SimulationOptions& options, const FloorPlan& plan, const std::vector<Vec3>& path);
  ~SensorStation();
  SensorStation(SensorStation&&) noexcept;
  SensorStation& operator=(SensorStation&&) noexcept;

  const StereoRig& rig() const;
  const World& world() const;
  Time start() const;

  /// Readings come at rig().imu_noise.rate_hz, the first at 0. `rotors`: speeds as shares of those that carry the vehicle.
  ImuSample read_imu(const MotionState& motion, const std::array<double, 4>& rotors);
  /// Of the reading that came last.
  TrueState truth() const;

  /// When the next image is taken (the middle of its exposure); a camera that loses frames has longer intervals.
  double next_image_s() const;
  /// No image's exposure reaches further to either side.
  double longest_exposure_s() const;
  /// Takes the image of next_image_s(). `motion`: the body's for the whole exposure. Stamps on the cameras' clock.
  RenderedFrame render(const std::function<MotionState(double t_s)>& motion);

 private:
  struct Impl;
  explicit SensorStation(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fbvins
