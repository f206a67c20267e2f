// SPDX-License-Identifier: Apache-2.0
// A vehicle's recent motion, for rendering images whose exposure has ended. One owner.
#pragma once

#include <algorithm>
#include <deque>

#include "fbvins/sim/imu_model.hpp"

namespace fbvins {

/// Interpolates the states of the last kHistory_s; clamps outside of them.
class MotionHistory {
 public:
  void add(double t_s, const MotionState& m) {
    states_.push_back({t_s, m});
    while (states_.front().t_s < t_s - kHistory_s) states_.pop_front();
  }
  MotionState at(double t_s) const {
    auto after = std::lower_bound(states_.begin(), states_.end(), t_s, [](const Entry& e, double t) { return e.t_s < t; });
    if (after == states_.begin()) return after->m;
    if (after == states_.end()) return states_.back().m;
    const Entry &a = *(after - 1), &b = *after;
    const double s = (t_s - a.t_s) / (b.t_s - a.t_s);
    MotionState m = b.m;
    m.T_WB = {a.m.T_WB.q.slerp(s, b.m.T_WB.q), Vec3((1 - s) * a.m.T_WB.p + s * b.m.T_WB.p)};
    m.v_WB = (1 - s) * a.m.v_WB + s * b.m.v_WB;
    m.w_WB_B = (1 - s) * a.m.w_WB_B + s * b.m.w_WB_B;
    return m;
  }

 private:
  static constexpr double kHistory_s = 0.06;
  struct Entry {
    double t_s;
    MotionState m;
  };
  std::deque<Entry> states_;
};

}  // namespace fbvins
