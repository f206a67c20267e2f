// SPDX-License-Identifier: Apache-2.0
// Dirt on a lens: blots and hairs, out of focus, through which some of the scene shines; at the same pixels in every image as
// long as they are there. Pure functions.
//
//   const Dirt dirt(752, 480, 3, seed);
//   dirt.draw(radiance);              // before the sensor model, as legs
#pragma once

#include <cstdint>
#include <vector>

#include "fbvins/types/image.hpp"

namespace fbvins {

class Dirt {
 public:
  Dirt(int width, int height, int count, std::uint64_t seed);

  /// Draws it over the radiance (row by row), lit by what is in view.
  void draw(std::vector<float>& radiance) const;
  /// Black where it takes half of the light or more, white elsewhere.
  Image seen() const;

 private:
  void add_blot(double x, double y, double radius, std::uint64_t seed);
  void add_hair(double x, double y, double length, std::uint64_t seed);
  void cover(int x, int y, double opacity, double reflectance);

  int width_, height_;
  std::vector<float> opacity_, reflectance_;  // row by row
};

}  // namespace fbvins
