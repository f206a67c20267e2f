// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/tag_search.hpp"

#include <algorithm>

#include "fbvins/calibration/corner_refine.hpp"

namespace fbvins {
namespace {

constexpr double kRadiusPart = 0.125;  ///< of the edge: the border's inner edge, or the next tag, is not nearer
constexpr double kLeastSearchRadius_px = 2, kLargestSearchRadius_px = 6;
constexpr double kSmallestQuad_px = 10;
constexpr int kNear_px = 12, kFarPart = 16;  ///< black and white: of what is near, or of this part of the image's width

/// Moves the corners to where edges cross; false for a square that is too small.
bool refine_quad(const ImageView& image, Quad& quad) {
  double side_px = 1e9;
  for (std::size_t k = 0; k < 4; ++k) side_px = std::min(side_px, (quad[k] - quad[(k + 1) % 4]).norm());
  if (!(side_px > kSmallestQuad_px)) return false;
  const double radius_px = std::clamp(kRadiusPart * side_px, kLeastSearchRadius_px, kLargestSearchRadius_px);
  const Quad given = quad;
  for (std::size_t k = 0; k < 4; ++k)
    if (const auto corner =
            refine_corner(image, given[k], given[(k + 1) % 4] - given[k], given[(k + 3) % 4] - given[k], radius_px))
      quad[k] = *corner;
  return true;
}

bool is_covered(const std::vector<TagDetection>& found, const Quad& quad) {
  const Vec2 middle = 0.25 * (quad[0] + quad[1] + quad[2] + quad[3]);
  return std::ranges::any_of(found, [&](const TagDetection& tag) {
    const auto& c = tag.corners;
    return (0.25 * (c[0] + c[1] + c[2] + c[3]) - middle).norm() < 0.25 * (c[0] - c[2]).norm();
  });
}

}  // namespace

std::vector<TagDetection> search_tags(const ImageView& image, const TagReader& reader, int enough) {
  std::vector<TagDetection> out;
  for (const int reach_px : {kNear_px, std::max(2 * kNear_px, image.width / kFarPart)})
    for (const int smaller_px : {1, 0}) {
      if (static_cast<int>(out.size()) >= enough) break;
      for (Quad& quad : dark_squares(image, {reach_px, smaller_px})) {
        if (is_covered(out, quad) || !refine_quad(image, quad)) continue;
        if (const auto tag = reader.read(image, quad)) out.push_back(*tag);
      }
    }
  std::ranges::stable_sort(out, {}, &TagDetection::id);
  return out;
}

}  // namespace fbvins
