// SPDX-License-Identifier: Apache-2.0
// The pixels of a camera that show the vehicle itself, dirt on the lens or nothing, and not the world. Immutable; any thread.
//
//   Image seen(752, 480, 255);
//   hide(seen, MaskCircle{376, 470, 60});
//   rig.cameras[0].camera.set_mask(std::make_shared<const Mask>(seen));
#pragma once

#include <cstdint>
#include <vector>

#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// Columns x to x + width - 1, rows y to y + height - 1, px.
struct MaskRectangle {
  double x = 0, y = 0, width = 0, height = 0;
  bool operator==(const MaskRectangle&) const = default;
};
/// Pixels whose centres are at most `radius` from (x, y), px.
struct MaskCircle {
  double x = 0, y = 0, radius = 0;
};

/// Blackens the part of the shape that lies in the image; false where none does.
bool hide(Image& seen, const MaskRectangle& rectangle);
bool hide(Image& seen, const MaskCircle& circle);

/// Distance that new features keep from what is hidden, px: the patch around one is 16 px wide.
inline constexpr double kMaskMargin_px = 10;

class Mask {
 public:
  /// Black is hidden, white is seen; grey values below 128 count as black.
  explicit Mask(const Image& seen);

  int width() const { return width_; }
  int height() const { return height_; }
  /// Whether a hidden pixel lies at most so far away, in x and in y: a square patch of twice that side would show it.
  bool hides(const Vec2& pixel, double margin_px = 0) const;
  /// Whether that is so of every pixel of columns x0 to x1 - 1 and rows y0 to y1 - 1 that is in the image.
  bool hides_all(int x0, int y0, int x1, int y1, double margin_px = 0) const;
  double hidden_share() const;
  /// 0 where hidden, 255 elsewhere.
  Image image() const;
  /// The hidden pixels as rectangles of whole pixels, none twice, from top to bottom: the mask as text.
  std::vector<MaskRectangle> rectangles() const;

 private:
  std::uint8_t distance(int x, int y) const { return distance_px_[static_cast<std::size_t>(y) * width_ + x]; }

  int width_, height_;
  std::vector<std::uint8_t> distance_px_;  // of each pixel to the nearest hidden one, the larger of x and y; 255 at most
};

}  // namespace fbvins
