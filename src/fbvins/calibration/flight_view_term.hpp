// SPDX-License-Identifier: Apache-2.0
// Private: where a camera sees a point at a keyframe, with derivatives by everything that a flight's calibration varies. Pure
// function, any thread.
#pragma once

#include <optional>

#include "fbvins/calibration/flight_rig.hpp"
#include "fbvins/camera/lens_projection.hpp"
#include "fbvins/imu/nav_state.hpp"

namespace fbvins {

/// What the IMU reads at a keyframe.
struct ReadingAt {
  Vec3 gyro_radps = Vec3::Zero(), accel_mps2 = Vec3::Zero();
};

struct ViewPlace {
  NavState<W> state;
  ReadingAt reading;
  double gravity_mps2 = kGravity_mps2;
  double late_s = 0;  ///< the image was taken so long after the state
};

/// Columns of `calibration`: lever, mounting, time offset, T_CnC0 (p, r), lens.
struct ViewDerivatives {
  static constexpr int kOffset = 6, kPair = 7, kLens = 13, kColumns = 13 + kMostLensParameters;
  Eigen::Matrix<double, 2, 9> state;  ///< p, theta, v
  Eigen::Matrix<double, 2, 3> point;
  Eigen::Matrix<double, 2, kColumns> calibration;
};

/// The pixel; nullopt where the lens does not see the point.
std::optional<Vec2> view_of(const FlightRig& rig, int camera, const ViewPlace& at, const Vec3& p_W,
                            ViewDerivatives* derivatives = nullptr);

}  // namespace fbvins
