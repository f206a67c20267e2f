// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_turns.hpp"

#include <algorithm>
#include <cmath>

namespace fbvins {

WindowTurns turns_of(const FrameList& frames) {
  WindowTurns out;
  double of_readings = 0, of_ends = 0;
  for (int j = 1; j < frames.size(); ++j) {
    const Preintegration* imu = frames[j].imu.get();
    if (imu == nullptr || imu->empty()) continue;
    const NavState<G>&from = frames[j - 1].state, &to = frames[j].state;
    const Quat by_readings = imu->corrected(from.bias).q;
    const Quat by_window = from.T_FB.q.conjugate() * to.T_FB.q;
    out.off_G += to.T_FB.q * so3_log((by_readings.conjugate() * by_window).normalized());
    out.turned_rad += so3_log(by_readings).norm();
    out.span = out.span + imu->dt();
    const double readings = imu->covariance_of_readings().block<3, 3>(nav::theta, nav::theta).trace();
    of_readings += readings / 3;
    of_ends = std::max(of_ends, imu->covariance().block<3, 3>(nav::theta, nav::theta).trace() - readings);
  }
  out.sigma_rad = std::sqrt(of_readings + of_ends);
  return out;
}

}  // namespace fbvins
