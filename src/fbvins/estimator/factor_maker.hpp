// SPDX-License-Identifier: Apache-2.0
// What makes factors of a frame's measurements. All makers of the estimator are registered in one place, factor_makers.cpp.
#pragma once

#include <memory>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/estimator/factor.hpp"
#include "fbvins/estimator/own_sensor.hpp"
#include "fbvins/estimator/sliding_window.hpp"
#include "fbvins/types/odometry.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// A frame that is about to join the window.
struct NewFrame {
  const TrackedFrame& tracked;
  const std::vector<TrackedFeature>& features;  ///< of the cameras to believe
  const Frame& frame;                           ///< with its predicted state
  SlidingWindow& window;                        ///< without it; for makers that bring a variable along (add_own)
  const Calibration& calibration;
  bool standstill = false;
  bool of_start = false;  ///< one of the frames from which the window is begun
};

class FactorMaker {
 public:
  virtual ~FactorMaker() = default;
  virtual std::vector<std::shared_ptr<const Factor>> make(const NewFrame& frame) = 0;
  /// What the sensor is doubted for, whose readings are left out.
  virtual HealthReason doubt() const { return HealthReason::none; }
};

/// In the order in which their factors are added up.
class FactorMakers {
 public:
  /// `sensors`: of the program that uses the library.
  FactorMakers(const StereoRig& rig, const EstimatorOptions& options,
               const std::vector<std::shared_ptr<OwnSensor>>& sensors = {});
  std::vector<FrameFactor> make(const NewFrame& frame);
  /// Of the first sensor that is.
  HealthReason doubt() const;

 private:
  std::vector<std::unique_ptr<FactorMaker>> makers_;
};

}  // namespace fbvins
