// SPDX-License-Identifier: Apache-2.0
// A rangefinder: what its beam hits lies on a level floor, whose height is a variable of the window (docs/rangefinder.md;
// docs/derivations/aiding.md, R1-R3). Heights above the same floor are compared over the whole flight, which shows the scale of
// one camera. Where the beam comes to a table, a box or a stair another floor begins; readings that lie on none are left out.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/estimator/factor_maker.hpp"
#include "fbvins/estimator/height_factor.hpp"
#include "fbvins/estimator/sensor_doubt.hpp"

namespace fbvins {

/// Says which readings lie on which floor. One owner.
class RangeMaker : public FactorMaker {
 public:
  /// `images_show_scale`: not with one camera, whose scale is then compared with landmarks on the floor, too.
  explicit RangeMaker(double floor_sigma_m, bool images_show_scale = true)
      : floor_sigma_m_(floor_sigma_m), images_show_scale_(images_show_scale) {}

  std::vector<std::shared_ptr<const Factor>> make(const NewFrame& frame) override;
  HealthReason doubt() const override { return doubt_ ? HealthReason::range_disagrees : HealthReason::none; }

 private:
  /// Where readings of one frame hit, on average.
  struct Hit {
    Vec3 p_B = Vec3::Zero();
    double sigma_m = 0;   ///< along the vertical, of the mean
    double height_m = 0;  ///< above the origin of G, by the predicted pose
    Time t;
  };
  struct Floor {
    int number;
    Time seen;
  };

  static std::optional<Hit> hit_of(const NewFrame& frame);
  double gate_m(const Hit& hit, const Floor& floor) const;
  Floor* floor_of(const Hit& hit, const SlidingWindow& window);
  Floor* floor_of_candidates(const Hit& hit, SlidingWindow& window);
  bool is_lowest(const Floor& floor, const SlidingWindow& window) const;

  double floor_sigma_m_;
  bool images_show_scale_;
  FrameId compared_;             ///< the newest keyframe whose distance was found by the floor
  std::vector<Floor> floors_;    ///< the newest last
  std::vector<Hit> candidates_;  ///< in a row, that lie on no known floor and on one with each other
  SensorDoubt doubt_;
};

}  // namespace fbvins
