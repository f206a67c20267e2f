// SPDX-License-Identifier: Apache-2.0
// A rangefinder: what its beam hits lies on a level floor, whose height is a variable of the window (docs/rangefinder.md;
// docs/derivations/range.md, R1-R3). Heights above the same floor are compared over the whole flight, which shows the scale of
// one camera. Where the beam comes to a table, a box or a stair another floor begins; readings that lie on none are left out.
#pragma once

#include <optional>
#include <vector>

#include "fbvins/estimator/factor_maker.hpp"

namespace fbvins {

class RangeFactor : public Factor {
 public:
  /// `hit_B`: where the beam hits, in the body of the frame. `floor`: number of the own variable.
  RangeFactor(FrameId frame, int floor, const Vec3& hit_B, double sigma_m)
      : frame_(frame), floor_(floor), hit_B_(hit_B), sigma_m_(sigma_m) {}

  std::string_view name() const override { return "range"; }
  std::vector<Variable> variables() const override {
    return {Variable::pose_of(frame_), Variable::tilt_of_gravity(), Variable::own_one(floor_)};
  }
  double cost(const WindowProblem& window) const override;
  double linearise(const WindowProblem& window, NormalEquations& out) const override;
  /// The successor has it instead: the motion between the two is known far better than the floor is flat.
  std::shared_ptr<const Factor> without(const DroppedFrame& dropped) const override;

  const Vec3& hit_B() const { return hit_B_; }
  double sigma_m() const { return sigma_m_; }

 private:
  double residual(const WindowProblem& window) const;

  FrameId frame_;
  int floor_;
  Vec3 hit_B_;
  double sigma_m_;
};

/// Says which readings lie on which floor. One owner.
class RangeMaker : public FactorMaker {
 public:
  /// `images_show_scale`: not with one camera, whose scale is then compared with landmarks on the floor, too.
  explicit RangeMaker(double floor_sigma_m, bool images_show_scale = true)
      : floor_sigma_m_(floor_sigma_m), images_show_scale_(images_show_scale) {}

  std::vector<std::shared_ptr<const Factor>> make(const NewFrame& frame) override;
  HealthReason doubt() const override { return left_out_s_ > kDoubt_s ? HealthReason::range_disagrees : HealthReason::none; }

 private:
  static constexpr double kDoubt_s = 1;
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
  void count(const Hit& hit, bool used);
  bool is_lowest(const Floor& floor, const SlidingWindow& window) const;

  double floor_sigma_m_;
  bool images_show_scale_;
  FrameId compared_;             ///< the newest keyframe whose distance was found by the floor
  std::vector<Floor> floors_;    ///< the newest last
  std::vector<Hit> candidates_;  ///< in a row, that lie on no known floor and on one with each other
  double left_out_s_ = 0;        ///< by readings that were left out, less those that were not
  std::optional<Time> newest_;
};

}  // namespace fbvins
