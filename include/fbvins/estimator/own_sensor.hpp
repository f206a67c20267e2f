// SPDX-License-Identifier: Apache-2.0
// A sensor that the library does not know, as a term of the window: a class in your own program, without a change of the library
// (examples/own_factor; docs/cpp.md, "A sensor of your own").
//
//   class Doppler : public fbvins::OwnSensor { ... };
//   auto system = fbvins::System::create(options, rig, mode, {.sensors = {std::make_shared<Doppler>()}});
//
// Threads: everything is called from the estimator's thread, in the order of images; what your own code hands over from
// another thread is yours to guard.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/gauge.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// The body at an image, by the estimate. G is the window's own frame: its origin and heading are those of the start, and up is
/// not exactly z.
struct BodyAtImage {
  Time t = {};
  Pose<G, B> T_GB = {};
  Vec3 v_GB = Vec3::Zero();  ///< m/s, in G
  ImuBias bias = {};
  Vec3 up_G = Vec3::UnitZ();  ///< of length 1
};

/// One measurement at an image. A value that never changes: it is asked again and again.
class OwnMeasurement {
 public:
  virtual ~OwnMeasurement() = default;
  /// What is measured less what the body's state says, in standard deviations, each number independent of the others. Always of
  /// one size. `variable`: the sensor's own, empty where it has none. Derivatives are found by differences: it has to be smooth.
  virtual Eigen::VectorXd residual(const BodyAtImage& body, const Eigen::VectorXd& variable) const = 0;
  /// Whether it depends on velocity or biases. Such a one is lost when its image leaves the window early; others are taken over
  /// by the image that follows.
  virtual bool is_of_motion() const { return false; }
};

class OwnSensor {
 public:
  virtual ~OwnSensor() = default;
  /// Of a variable that is estimated with the body (a bias, a height), at the start; empty: there is none. It should be of the
  /// size of 0.01 to 100, and measurements have to determine it.
  virtual Eigen::VectorXd first_variable() const { return {}; }
  /// What has been measured since the image before, at this image. `predicted` is the body before any image's weight, and
  /// `variable` as estimated so far: leave out what cannot be right.
  virtual std::vector<std::shared_ptr<const OwnMeasurement>> measured(const BodyAtImage& predicted,
                                                                      const Eigen::VectorXd& variable) = 0;
};

}  // namespace fbvins
