// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/flight_session.hpp"

namespace fbvins {

FlightSession::FlightSession(const Keyframe& first, std::uint32_t number, bool began_map, const DriftOptions& drift,
                             std::size_t cameras)
    : begun_(true),
      began_map_(began_map),
      number_(number),
      reset_counter_(first.reset_counter),
      drift_(drift),
      q_LG_(first.gauge.q_LG),
      newest_level_{first.gauge.q_LG, first.gauge.up_sigma_rad},
      newest_of_(cameras) {}

void FlightSession::advance(const Keyframe& keyframe, std::optional<Time> newest_t) {
  const double step_m = gauge_ ? (keyframe.gauge.T_GB.p - gauge_->T_GB.p).norm() : 0;
  path_m_ += step_m;
  gauge_ = keyframe.gauge;
  motion_.add(keyframe);
  drift_.take(keyframe.pose_covariance, keyframe.gauge, path_m_);
  vertical_.advance(drift_over(drift(), step_m, 0).yaw_rad2);
  scale_.add(keyframe.scale_sigma);
  readings_.add(keyframe.imu.segments, keyframe.t, newest_t);
}

}  // namespace fbvins
