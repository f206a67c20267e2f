// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/sensor_station.hpp"

#include <cmath>

#include "fbvins/core/options.hpp"
#include "fbvins/sim/flight_recorder.hpp"
#include "fbvins/sim/rotor_shake.hpp"
#include "fbvins/sim/simulation_parts.hpp"

namespace fbvins {

struct SensorStation::Impl {
  SimulationOptions options;
  StereoRig rig;
  std::shared_ptr<const World> world;
  BodyMotion motion;  ///< of the image being rendered
  FlightRecorder recorder;
  ImuErrors errors;
  RotorShake shake;
  FrameTimes frames;
  TrueState truth;
  std::int64_t readings = 0, images = 0;

  Impl(const SimulationOptions& o, const StereoRig& r, std::shared_ptr<const World> w)
      : options(o),
        rig(r),
        world(std::move(w)),
        recorder(
            o, r, [this](double t) { return motion(t); }, Vec3::Zero(), world),
        errors(r.imu_noise, o.imu, static_cast<std::uint64_t>(o.seed)),
        shake(static_cast<std::uint64_t>(o.seed)),
        frames(o) {}
};

Result<SensorStation> SensorStation::create(const SimulationOptions& options, const FloorPlan& plan,
                                            const std::vector<Vec3>& path) {
  if (Result<void> valid = validate(options); !valid) return valid.error();
  if (auto intervals = image_intervals_s(options); !intervals) return intervals.error();
  Result<StereoRig> rig = simulated_rig(options);
  if (!rig) return rig.error();
  const auto seed = static_cast<std::uint64_t>(options.seed);
  return SensorStation(
      std::make_unique<Impl>(options, *rig, std::make_shared<const World>(build_world(options.world, plan, path, seed))));
}

SensorStation::SensorStation(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SensorStation::~SensorStation() = default;
SensorStation::SensorStation(SensorStation&&) noexcept = default;
SensorStation& SensorStation::operator=(SensorStation&&) noexcept = default;

const StereoRig& SensorStation::rig() const { return impl_->rig; }
const World& SensorStation::world() const { return *impl_->world; }
Time SensorStation::start() const { return kSimulationStart; }
TrueState SensorStation::truth() const { return impl_->truth; }
double SensorStation::next_image_s() const { return impl_->frames.next_s(); }
double SensorStation::longest_exposure_s() const {
  const auto intervals = image_intervals_s(impl_->options);
  const double longer = intervals->empty() ? 1 : intervals->back() / intervals->front();
  return longer * impl_->options.camera.max_exposure_ms * 1e-3;
}

ImuSample SensorStation::read_imu(const MotionState& motion, const std::array<double, 4>& rotors) {
  const double dt = 1 / impl_->rig.imu_noise.rate_hz;
  const Time t = kSimulationStart + Duration{std::llround(static_cast<double>(impl_->readings++) * dt * 1e9)};
  impl_->truth = {t, motion.T_WB, motion.v_WB, impl_->errors.bias()};
  return impl_->errors.read(t, motion, impl_->shake.step(rotors, dt));
}

RenderedFrame SensorStation::render(const std::function<MotionState(double t_s)>& motion) {
  impl_->motion = motion;
  RenderedFrame rendered = render_at(impl_->recorder, impl_->rig, impl_->frames.next_s(), impl_->images++);
  impl_->motion = {};
  impl_->frames.advance();
  return rendered;
}

}  // namespace fbvins
