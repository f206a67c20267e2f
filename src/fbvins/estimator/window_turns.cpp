// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/window_turns.hpp"

#include <cmath>

namespace fbvins {

WindowTurns turns_of(const FrameList& frames) {
  WindowTurns out;
  double variance = 0;
  for (int j = 1; j < frames.size(); ++j) {
    const Preintegration* imu = frames[j].imu.get();
    if (imu == nullptr || imu->empty()) continue;
    const NavState<G>&from = frames[j - 1].state, &to = frames[j].state;
    const Quat by_readings = imu->corrected(from.bias).q;
    const Quat by_window = from.T_FB.q.conjugate() * to.T_FB.q;
    out.off_G += to.T_FB.q * so3_log((by_readings.conjugate() * by_window).normalized());
    out.turned_rad += so3_log(by_readings).norm();
    out.span = out.span + imu->dt();
    variance += imu->covariance().block<3, 3>(3, 3).trace() / 3;
  }
  out.sigma_rad = std::sqrt(variance);
  return out;
}

}  // namespace fbvins
