// SPDX-License-Identifier: Apache-2.0
// The 48 ways to name and sign three axes. Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {

const std::vector<Mat3>& signed_permutations();
/// The one nearest to a rotation or reflection.
Mat3 nearest_axes(const Mat3& R);
/// "y, -x, z": which of the given axes each of x, y, z is.
std::string axes_text(const Mat3& axes);

}  // namespace fbvins
