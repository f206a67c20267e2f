// SPDX-License-Identifier: Apache-2.0
// Private to tests of the estimator: a simulated flight, estimated and compared with the truth.
//
//   SimulatedFlight flight(Motion(0.6, 0.3), 1);
//   const EstimatedFlight flown = fly(flight, 200);
//   EXPECT_LT(flown.position_error(199), 0.04);
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <numbers>
#include <vector>

#include "fbvins/estimator/estimator.hpp"
#include "fbvins/geometry/heading.hpp"
#include "fbvins/geometry/so3.hpp"
#include "tests/support/simulated_flight.hpp"

namespace fbvins::test {

inline EstimatorOptions exact_noise() {
  EstimatorOptions o;  // the simulated IMU has the calibrated noise
  o.gyro_unmodelled_radps_rthz = o.accel_unmodelled_mps2_rthz = 0;
  o.gyro_walk_scale = o.accel_walk_scale = 1;
  return o;
}

struct EstimatedFlight {
  std::vector<Odometry> odometry;
  std::vector<NavState<W>> truth;
  int gauge_frame = -1;  ///< the frame of the first pose, which defines W's position and heading
  Pose<W, B> gauge_pose;

  int first_pose() const {
    for (std::size_t k = 0; k < odometry.size(); ++k)
      if (odometry[k].health.has_pose()) return static_cast<int>(k);
    return -1;
  }
  /// The truth at k in W.
  NavState<W> truth_in_W(int k) const {
    const Pose<W, B>& b = truth[gauge_frame].T_FB;
    const Quat turn(Eigen::AngleAxisd(heading_between(b.q, gauge_pose.q), Vec3::UnitZ()));
    NavState<W> s = truth[k];
    s.T_FB = {(turn * s.T_FB.q).normalized(), Vec3(gauge_pose.p + turn * (s.T_FB.p - b.p))};
    s.v_FB = turn * s.v_FB;
    return s;
  }
  double position_error(int k) const { return (odometry[k].T_WB.p - truth_in_W(k).T_FB.p).norm(); }
};

template <class Flight>
EstimatedFlight fly(Flight& flight, int frames, const EstimatorOptions& options = exact_noise()) {
  Estimator estimator(flight.rig, options);
  EstimatedFlight out;
  for (int k = 0; k < frames; ++k) {
    out.odometry.push_back(estimator.process(flight.frame(k)).odometry);
    out.truth.push_back(flight.truth(k));
    if (out.gauge_frame < 0 && out.odometry.back().health.has_pose()) {
      out.gauge_frame = k;
      out.gauge_pose = out.odometry.back().T_WB;
    }
  }
  return out;
}

/// Normalised error squared of the pose.
inline double normalised_error(const EstimatedFlight& flown, int k) {
  const Odometry& o = flown.odometry[k];
  const NavState<W> truth = flown.truth_in_W(k);
  Vec6 e;
  e << o.T_WB.p - truth.T_FB.p, so3_log(truth.T_FB.q.conjugate() * o.T_WB.q);
  return e.dot(o.pose_covariance.ldlt().solve(e));
}

/// A second pair, cameras 2 and 3, looks backwards.
struct FourCameras {
  SimulatedFlight front, back;
  StereoRig rig;

  FourCameras(const Motion& motion, std::uint64_t seed) : front(motion, seed), back(motion, seed + 1000), rig(front.rig) {
    const Pose<B, B> turned(so3_exp(Vec3(0, 0, std::numbers::pi)), Vec3::Zero());
    for (MountedCamera& mounted : back.rig.cameras) mounted.T_BC = turned * mounted.T_BC;
    rig.cameras.insert(rig.cameras.end(), {back.rig.mounted(0), back.rig.mounted(1)});
  }
  NavState<W> truth(int k) const { return front.truth(k); }
  TrackedFrame frame(int k) {
    TrackedFrame out = front.frame(k);
    const TrackedFrame other = back.frame(k);
    out.set_has(2, other.has(0)), out.set_has(3, other.has(1));
    out.stats.stereo += other.stats.stereo;
    for (TrackedFeature feature : other.features) {
      feature.id.value += 1'000'000;
      feature.lead += 2;
      for (Observation& o : feature.seen) o.camera += 2;
      out.features.push_back(feature);
    }
    return out;
  }
};

}  // namespace fbvins::test
