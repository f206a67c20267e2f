// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/side_by_side.hpp"

#include <algorithm>

namespace fbvins {

bool is_side_by_side(std::int64_t width, std::int64_t height, const StereoRig& rig) {
  return rig.camera_count() == 2 && width == 2 * std::int64_t{rig.left().width()} && height == rig.left().height() &&
         rig.right().width() == rig.left().width() && rig.right().height() == rig.left().height();
}

Image half_of(const Image& both, int camera) {
  Image out(both.width() / 2, both.height());
  const int from = camera == 1 ? out.width() : 0;
  for (int y = 0; y < out.height(); ++y) std::copy_n(both.row(y) + from, out.width(), out.row(y));
  return out;
}

}  // namespace fbvins
