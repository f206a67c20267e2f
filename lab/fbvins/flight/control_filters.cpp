// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/control_filters.hpp"

#include <cmath>
#include <numbers>

namespace fbvins {

ButterworthFilter::ButterworthFilter(double rate_hz, double cutoff_hz) {
  if (cutoff_hz >= 0.5 * rate_hz) return;
  const double k = std::tan(std::numbers::pi * cutoff_hz / rate_hz), norm = 1 / (1 + std::numbers::sqrt2 * k + k * k);
  b0_ = b2_ = k * k * norm;
  b1_ = 2 * b0_;
  a1_ = 2 * (k * k - 1) * norm;
  a2_ = (1 - std::numbers::sqrt2 * k + k * k) * norm;
}

Vec3 ButterworthFilter::operator()(const Vec3& x) {
  if (!started_) {  // steady state
    started_ = true;
    s2_ = (b2_ - a2_) * x;
    s1_ = (b1_ - a1_) * x + s2_;
  }
  const Vec3 y = b0_ * x + s1_;
  s1_ = b1_ * x - a1_ * y + s2_;
  s2_ = b2_ * x - a2_ * y;
  return y;
}

LagFilter::LagFilter(double rate_hz, double cutoff_hz) : share_(1 - std::exp(-2 * std::numbers::pi * cutoff_hz / rate_hz)) {}

Vec3 LagFilter::operator()(const Vec3& x) {
  y_ = started_ ? Vec3(y_ + share_ * (x - y_)) : x;
  started_ = true;
  return y_;
}

}  // namespace fbvins
