// SPDX-License-Identifier: Apache-2.0
// The one place where factors are registered.
#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/estimator/barometer_factor.hpp"
#include "fbvins/estimator/factor_maker.hpp"
#include "fbvins/estimator/own_sensor_factor.hpp"
#include "fbvins/estimator/range_factor.hpp"
#include "fbvins/estimator/standstill_factor.hpp"
#include "fbvins/estimator/surface_view.hpp"
#include "fbvins/estimator/velocity_factor.hpp"

namespace fbvins {

FactorMakers::FactorMakers(const StereoRig& rig, const EstimatorOptions& options,
                           const std::vector<std::shared_ptr<OwnSensor>>& sensors) {
  makers_.push_back(std::make_unique<StandstillMaker>());
  if (rig.depth) makers_.push_back(std::make_unique<SurfaceMaker>(rig));
  if (options.velocity.enabled) makers_.push_back(std::make_unique<VelocityMaker>(options.velocity.slip_mps, has_stereo(rig)));
  if (options.barometer.enabled) makers_.push_back(std::make_unique<BarometerMaker>(options.barometer.drift_m_rts));
  if (options.rangefinder.enabled)
    makers_.push_back(std::make_unique<RangeMaker>(options.rangefinder.floor_sigma_m, has_stereo(rig)));
  for (const std::shared_ptr<OwnSensor>& sensor : sensors) makers_.push_back(std::make_unique<OwnSensorMaker>(sensor));
}

std::vector<FrameFactor> FactorMakers::make(const NewFrame& frame) {
  std::vector<FrameFactor> out;
  for (std::size_t order = 0; order < makers_.size(); ++order)
    for (std::shared_ptr<const Factor>& factor : makers_[order]->make(frame))
      out.push_back({static_cast<int>(order), std::move(factor)});
  return out;
}

HealthReason FactorMakers::doubt() const {
  for (const auto& maker : makers_)
    if (const HealthReason reason = maker->doubt(); reason != HealthReason::none) return reason;
  return HealthReason::none;
}

}  // namespace fbvins
