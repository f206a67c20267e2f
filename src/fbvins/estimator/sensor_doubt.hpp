// SPDX-License-Identifier: Apache-2.0
// Whether a sensor is doubted: its readings have been left out for longer than others were used. A value.
//
//   doubt.count(t, used);
//   if (doubt) ...
#pragma once

#include <optional>

#include "fbvins/core/time.hpp"

namespace fbvins {

class SensorDoubt {
 public:
  explicit SensorDoubt(double after_s = 1) : after_s_(after_s) {}
  void count(Time t, bool used);
  explicit operator bool() const { return left_out_s_ > after_s_; }

 private:
  double after_s_;
  double left_out_s_ = 0;  ///< by readings that were left out, less those that were not
  std::optional<Time> newest_;
};

}  // namespace fbvins
