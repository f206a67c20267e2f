// SPDX-License-Identifier: Apache-2.0
// Anchors: measurements that tie the map to a building. They say where the body is in the building's frame A, by a sensor outside
// (UWB, GNSS at a door, motion capture, a surveyed point where the vehicle stands), or how high it is, or where a tag is that
// hangs at a known place. They correct the map M, never the odometry's frame W; once they determine position and heading, M is
// the building's frame (docs/derivations/loop.md, L21-L25).
//
//   system.push(PositionAnchor{.t = t, .p_A = p_A, .covariance = 0.01 * Mat3::Identity(), .p_B = antenna_B});
#pragma once

#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/pose.hpp"

namespace fbvins {

/// The building's frame, z up: that in which anchors are surveyed.
struct A {};
/// The frame of an AprilTag: origin in its middle, x to the right and y upwards as a viewer of the upright tag sees it, z towards
/// the viewer.
struct Tag {};

/// Where a point of the body is. All stamps are on the images' clock.
struct PositionAnchor {
  Time t = {};
  Vec3 p_A = Vec3::Zero();  ///< m
  Mat3 covariance = Mat3::Identity();
  Vec3 p_B = Vec3::Zero();  ///< the point: an antenna, a marker, m
};

/// How high it is, above z = 0 of the building.
struct HeightAnchor {
  Time t = {};
  double z_A_m = 0, sigma_m = 1;
  Vec3 p_B = Vec3::Zero();
};

/// A tag that was seen, and where it hangs. Where that is not known the tag is a landmark of the map: it says where the vehicle
/// is when it is seen again, in this flight or in another.
struct TagAnchor {
  Time t = {};
  int id = 0;
  Pose<A, Tag> T_AT = {};  ///< p is NaN: not known
  Pose<B, Tag> T_BT = {};
  Mat6 covariance = Mat6::Identity();  ///< of T_BT, as (dp in B, dtheta in the tag)

  bool has_place() const { return !T_AT.p.array().isNaN().all(); }
};

/// TagAnchor::T_AT of a tag whose place is not known.
inline Pose<A, Tag> unknown_place() { return {Quat::Identity(), Vec3::Constant(std::numeric_limits<double>::quiet_NaN())}; }

using Anchor = std::variant<PositionAnchor, HeightAnchor, TagAnchor>;

Time stamp_of(const Anchor& anchor);

/// What makes an anchor unusable, in words: a number that is not finite, a covariance that is none. Empty: nothing.
std::string impossible(const Anchor& anchor);

}  // namespace fbvins
