// SPDX-License-Identifier: Apache-2.0
// Corners of tags and chessboards to a small part of a pixel: a model of two crossing blurred edges, fitted to the grey values.
// Pure function.
#pragma once

#include <optional>

#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// The corner near `start` at which two edges cross that run about along `first` and `second` (px, any length). Pixels within
/// `radius_px` (2 or more) are used: no other edge may lie so near. nullopt where there is no such corner, it lies farther from
/// the start than the radius, or too near to the border.
std::optional<Vec2> refine_corner(const ImageView& image, const Vec2& start, const Vec2& first, const Vec2& second,
                                  double radius_px);

}  // namespace fbvins
