// SPDX-License-Identifier: Apache-2.0
// The 48 signed permutations of three axes. Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

const std::vector<Mat3>& signed_permutations();
/// The one nearest to a rotation or reflection.
Mat3 nearest_axes(const Mat3& R);
/// "y, -x, z": the input axis, with its sign, that each of x, y, z is taken from.
std::string axes_text(const Mat3& axes);

}  // namespace fbvins
