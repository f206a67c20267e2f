// SPDX-License-Identifier: Apache-2.0
#include "fbvins/camera/scaled_lens.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

namespace fbvins {
namespace {

LensModel scaled(LensModel model, double factor) {
  std::visit(
      [factor](auto& m) {
        m.fx *= factor, m.fy *= factor;
        m.cx = (m.cx + 0.5) * factor - 0.5, m.cy = (m.cy + 0.5) * factor - 0.5;
      },
      model);
  return model;
}

Mask resized(const Mask& mask, int width, int height) {
  Image seen(width, height);
  const auto from = [](int at, int side, int size) { return std::min((2 * at + 1) * size / (2 * side), size - 1); };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      seen.at(x, y) = mask.hides(Vec2(from(x, width, mask.width()), from(y, height, mask.height()))) ? 0 : 255;
  return Mask(seen);
}

}  // namespace

Camera with_scaled_lens(const Camera& camera, double factor) { return camera.with_lens(scaled(camera.model(), factor)); }

std::optional<Camera> scaled_to(const Camera& camera, int width, int height) {
  if (camera.width() <= 0 || camera.height() <= 0 || width <= 0 || height <= 0) return std::nullopt;
  const double factor = static_cast<double>(width) / camera.width();
  if (std::abs(factor * camera.height() - height) > std::max(1.0, factor)) return std::nullopt;
  Camera out(scaled(camera.model(), factor), width, height);
  if (camera.mask()) out.set_mask(std::make_shared<const Mask>(resized(*camera.mask(), width, height)));
  out.set_own_times(camera.own_times());
  return out;
}

std::optional<Camera> middle_of(const Camera& camera, int width, int height) {
  const int left = camera.width() - width, top = camera.height() - height;  // twice what is cut there
  if (left < 0 || top < 0 || left + top == 0 || 2 * width < camera.width() || 2 * height < camera.height()) return std::nullopt;
  LensModel model = camera.model();
  std::visit([&](auto& m) { m.cx -= 0.5 * left, m.cy -= 0.5 * top; }, model);
  Camera out(model, width, height);
  if (camera.mask()) {
    Image seen(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) seen.at(x, y) = camera.mask()->hides(Vec2(x + left / 2, y + top / 2)) ? 0 : 255;
    out.set_mask(std::make_shared<const Mask>(seen));
  }
  out.set_own_times(camera.own_times());
  return out;
}

}  // namespace fbvins
