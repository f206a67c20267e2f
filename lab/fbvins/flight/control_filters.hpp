// SPDX-License-Identifier: Apache-2.0
// Low-pass filters of the controller. One owner each.
#pragma once

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// Second-order Butterworth filter by the bilinear transform. It starts in steady state at the first sample.
class ButterworthFilter {
 public:
  /// With a cutoff at or above half the rate the input passes unchanged.
  ButterworthFilter(double rate_hz, double cutoff_hz);
  Vec3 operator()(const Vec3& x);

 private:
  double b0_ = 1, b1_ = 0, b2_ = 0, a1_ = 0, a2_ = 0;
  Vec3 s1_ = Vec3::Zero(), s2_ = Vec3::Zero();
  bool started_ = false;
};

/// First-order filter. It starts at the first sample.
class LagFilter {
 public:
  LagFilter(double rate_hz, double cutoff_hz);
  Vec3 operator()(const Vec3& x);

 private:
  double share_;
  Vec3 y_ = Vec3::Zero();
  bool started_ = false;
};

}  // namespace fbvins
