// SPDX-License-Identifier: Apache-2.0
// Where the odometry's frame W lies in the map M right now: a Kalman filter over position and yaw of the body in M,
// which odometry drift widens and recognised places narrow (docs/derivations/loop.md, L12-L14); and a follower that
// moves towards it by a bounded amount a second, for those who fly by it. Values; one thread at a time.
//
//   MapFrame frame(options);
//   frame.reset(T_MW);
//   frame.advance(T_WB, t);                       // every keyframe
//   if (frame.mahalanobis2(seen) < 25) frame.update(seen);
//   Pose<M, B> T_MB = frame.T_MW() * T_WB;
#pragma once

#include <optional>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/loop/loop_options.hpp"

namespace fbvins {

using Vec4 = Eigen::Vector4d;
using Mat4 = Eigen::Matrix4d;

/// Variances of position and yaw that the odometry gathers over `metres` and `seconds`.
struct DriftVariance {
  double position_m2 = 0, yaw_rad2 = 0;
};
DriftVariance drift_over(const DriftOptions& options, double metres, double seconds);

/// A pose of the body in M as some place says, with the covariance of (position, yaw).
struct SeenPose {
  Pose<M, B> T_MB;
  Mat4 covariance = Mat4::Identity();
};

/// Rotation about z of a rotation that is nearly one, rad; and the rotation about z by that much.
double yaw_of(const Quat& q);
Quat about_z(double yaw_rad);

class MapFrame {
 public:
  explicit MapFrame(const DriftOptions& options) : options_(options) {}

  bool known() const { return known_; }
  const Pose<M, W>& T_MW() const { return T_MW_; }
  /// Of the body's position in M [m] and the yaw of T_MW [rad].
  const Mat4& covariance() const { return P_; }

  void forget() { known_ = false, last_.reset(); }
  /// Takes over a frame; `sigma` of position [m], of yaw [rad]. Only the yaw and the position of T_MW are kept.
  void reset(const Pose<M, W>& T_MW, double sigma_m, double sigma_rad);
  /// The odometry went on to here.
  void advance(const Pose<W, B>& T_WB, Time t);
  double mahalanobis2(const SeenPose& seen) const;
  void update(const SeenPose& seen);

 private:
  struct Stamped {
    Time t;
    Pose<W, B> T_WB;
  };
  Vec4 innovation(const SeenPose& seen) const;

  DriftOptions options_;
  bool known_ = false;
  Pose<M, W> T_MW_;
  Mat4 P_ = Mat4::Zero();
  std::optional<Stamped> last_;
};

/// Follows T_MW without a step: at the body, at most `max_mps` and `max_radps`.
class MapFrameFollower {
 public:
  MapFrameFollower(double max_mps, double max_radps) : max_mps_(max_mps), max_radps_(max_radps) {}
  /// Starts over at the next follow().
  void forget() { last_.reset(); }
  const Pose<M, W>& follow(const Pose<M, W>& target, const Pose<W, B>& T_WB, Time t);

 private:
  double max_mps_, max_radps_;
  std::optional<Time> last_;
  Pose<M, W> T_MW_;
};

}  // namespace fbvins
