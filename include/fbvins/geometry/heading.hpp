// SPDX-License-Identifier: Apache-2.0
// Rotation about the vertical, the part of an attitude that gravity does not determine.
#pragma once

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// The rotation about z, rad, that brings `from` closest to `to`.
inline double heading_between(const Quat& from, const Quat& to) {
  const Mat3 E = (to * from.conjugate()).toRotationMatrix();
  return std::atan2(E(1, 0) - E(0, 1), E(0, 0) + E(1, 1));
}

}  // namespace fbvins
