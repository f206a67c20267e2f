// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/coverage.hpp"

#include <algorithm>

namespace fbvins {

Coverage coverage_of(std::vector<Time> images, std::vector<Time> poses, Duration tolerance) {
  std::sort(images.begin(), images.end());
  std::sort(poses.begin(), poses.end());
  Coverage c;
  c.images = static_cast<int>(images.size());
  for (Time t : images) {
    const auto near = std::lower_bound(poses.begin(), poses.end(), t - tolerance);
    if (near == poses.end() || *near > t + tolerance) continue;
    if (c.with_pose++ == 0) c.first_pose_after_s = (t - images.front()).seconds();
  }
  if (c.images > 0) c.share = static_cast<double>(c.with_pose) / c.images;
  for (std::size_t i = 1; i < poses.size(); ++i)
    c.longest_hole_s = std::max(c.longest_hole_s, (poses[i] - poses[i - 1]).seconds());
  return c;
}

}  // namespace fbvins
