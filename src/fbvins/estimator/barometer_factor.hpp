// SPDX-License-Identifier: Apache-2.0
// A barometer: the pressure says how high the body is above a level that drifts, a variable of the window for every few seconds
// (docs/barometer.md; docs/derivations/aiding.md, P1-P3). Readings that jump are left out, as when a door opens or the
// vehicle's wind comes back from the ground; where the jump stays, a new level begins.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "fbvins/estimator/factor_maker.hpp"
#include "fbvins/estimator/sensor_doubt.hpp"

namespace fbvins {

/// How high the air's pressure says one is above where it was `reference_pa`, in the standard atmosphere.
double pressure_height_m(double pressure_pa, double reference_pa);

/// Two levels, one after the other, differ as far as the pressure drifts.
class LevelDrift : public Factor {
 public:
  /// `frame`: with which it is marginalised.
  LevelDrift(FrameId frame, int before, int after, double sigma_m)
      : frame_(frame), before_(before), after_(after), sigma_m_(sigma_m) {}

  std::string_view name() const override { return "level drift"; }
  std::vector<Variable> variables() const override {
    return {Variable::pose_of(frame_), Variable::own_one(before_), Variable::own_one(after_)};
  }
  double cost(const WindowProblem& window) const override;
  double linearise(const WindowProblem& window, NormalEquations& out) const override;
  std::shared_ptr<const Factor> without(const DroppedFrame& dropped) const override;

 private:
  double residual(const WindowProblem& window) const;

  FrameId frame_;
  int before_, after_;
  double sigma_m_;
};

/// One owner.
class BarometerMaker : public FactorMaker {
 public:
  explicit BarometerMaker(double drift_m_rts) : drift_m_rts_(drift_m_rts) {}

  std::vector<std::shared_ptr<const Factor>> make(const NewFrame& frame) override;
  HealthReason doubt() const override { return doubt_ ? HealthReason::pressure_disagrees : HealthReason::none; }

 private:
  /// What the readings of one frame say on average.
  struct Height {
    double above_m = 0;  ///< the reference
    double level_m = 0;  ///< of what it is above, in G, by the predicted pose
    double sigma_m = 0;
    Time t;
  };
  struct Level {
    int number;
    Time begun, seen;
  };

  std::optional<Height> height_of(const NewFrame& frame);
  bool fits(const Height& height, const SlidingWindow& window) const;
  bool stays(const Height& height);
  void begin_level(const Height& height, double level_m, SlidingWindow& window);

  double drift_m_rts_;
  std::optional<double> reference_pa_;
  std::optional<Level> level_;
  std::optional<int> ended_;   ///< the level before, that the drift's factor names
  std::vector<Height> apart_;  ///< in a row, that do not fit, and fit to one another
  SensorDoubt doubt_{4};
};

}  // namespace fbvins
