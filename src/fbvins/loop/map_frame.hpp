// SPDX-License-Identifier: Apache-2.0
// The present pose of a flight's gauge G in the map M: a Kalman filter over position and yaw of the body in M, predicted with
// the odometry's drift and updated by recognised places (docs/derivations/loop.md, L12-L14); its tilt is not filtered but
// the flight's own estimate of gravity. Of a flight of one camera it estimates the scale as well (L34). Where M is the frame of
// anchors, they update it as well (L23). And a follower of T_MW of limited speed, for controllers that fly in M. Values; one
// thread at a time.
//
//   MapFrame frame;
//   frame.level(q_LG);
//   frame.reset(T_MG, 0.05, 0.01);
//   frame.advance(T_GB, t, drift);                // every keyframe
//   if (frame.mahalanobis2(seen) < 25) frame.update(seen);
//   Pose<M, B> T_MB = frame.T_MG() * T_GB;
#pragma once

#include <optional>
#include <span>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/loop/loop_options.hpp"
#include "fbvins/loop/partial_pose.hpp"
#include "fbvins/types/gauge.hpp"

namespace fbvins {

using Vec4 = Eigen::Vector4d;
using Mat4 = Eigen::Matrix4d;

/// Variances of position and yaw that the odometry gathers over `metres` and `seconds`.
struct DriftVariance {
  double position_m2 = 0, yaw_rad2 = 0;
};
DriftVariance drift_over(const DriftOptions& options, double metres, double seconds);

/// A pose of the body in M from a recognised place, with the covariance of (position, yaw).
struct MeasuredPose {
  Pose<M, B> T_MB;
  Mat4 covariance = Mat4::Identity();
  double tilt_variance_rad2 = 0;  ///< of roll and pitch, each
};

/// Yaw of a rotation that is nearly about z, rad; and the rotation about z by an angle.
double yaw_of(const Quat& q);
Quat about_z(double yaw_rad);

/// The turn about z and the shift that bring poses of a map nearest to where they are `wanted`, as many: the sum of the squared
/// distances, and of the squared turns times `lever_m`, is least.
Pose<M, M> nearest_to(std::span<const Pose<M, B>> wanted, std::span<const Pose<M, B>> poses, double lever_m);

class MapFrame {
 public:
  bool known() const { return known_; }
  const Pose<M, G>& T_MG() const { return T_MG_; }
  /// The turn about z from G, level, to M.
  Quat yaw() const { return about_z(yaw_rad_); }
  /// Of the body's position in M [m] and the yaw of G in M [rad].
  const Mat4& covariance() const { return P_; }

  void forget() { known_ = false, last_.reset(), scale_ = {}; }
  /// Takes a new estimate of q_LG, which turns G level: the body stays where it is in M, and so does the yaw.
  void level(const Quat& q_LG);
  /// Of roll and pitch of G in M, where an anchor is taken for what they change in it.
  void set_tilt_sigma(double rad) { tilt_rad_ = rad; }
  /// All of M is turned, the body with it: T takes old coordinates in M to new ones. Call level() afterwards.
  void turn(const Pose<M, M>& T) { T_MG_ = T * T_MG_; }
  /// Sets the frame, with standard deviations of position and of yaw. Of T_MG only the yaw and where it puts the body are
  /// kept: its tilt follows from q_LG.
  void reset(const Pose<M, G>& T_MG, double sigma_m, double sigma_rad);
  /// Predicts: the odometry's next pose, how fast it drifts, and the relative standard deviation of its lengths; 0: it measures
  /// them.
  void advance(const Pose<G, B>& T_GB, Time t, const DriftOptions& drift, double scale_sigma = 0);
  /// Logarithm of the length in M of a metre of the odometry.
  double log_scale() const { return scale_.log; }
  /// A graph has found it, with everything that reset() is told.
  void set_log_scale(double log) { scale_.log = log; }
  double mahalanobis2(const MeasuredPose& seen) const;
  void update(const MeasuredPose& seen);
  /// The same for an anchor that measures the body at `T_GB`, which may be an earlier pose; M is the anchors' frame.
  double mahalanobis2(const PartialPose& seen, const Pose<G, B>& T_GB) const;
  void update(const PartialPose& seen, const Pose<G, B>& T_GB);

 private:
  struct Stamped {
    Time t;
    Pose<G, B> T_GB;
  };
  /// Measured minus predicted, of unit variance, and the derivatives of the prediction by the state.
  struct Whitened {
    Vec6 v;
    Eigen::Matrix<double, 6, 4> H;
  };
  /// Of the odometry in M, with the covariance to the other states.
  struct Scale {
    double log = 0, variance = 0;
    Vec4 with = Vec4::Zero();
  };
  void advance_scale(const Vec3& step_M, const Mat4& F, double sigma);
  Whitened innovation(const PartialPose& seen, const Pose<G, B>& T_GB) const;
  Vec4 innovation(const MeasuredPose& seen) const;
  /// Where the body is in G; its origin before the odometry has begun.
  Vec3 body() const { return last_ ? last_->T_GB.p : Vec3(Vec3::Zero()); }
  void put(double yaw_rad, const Vec3& p_MB);

  bool known_ = false;
  Quat q_LG_ = Quat::Identity();
  double yaw_rad_ = 0, tilt_rad_ = kTilt_rad;
  Pose<M, G> T_MG_;
  Mat4 P_ = Mat4::Zero();
  Scale scale_;
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
