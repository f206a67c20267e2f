// SPDX-License-Identifier: Apache-2.0
// The vehicle's own legs in view: bars from the image's edges inwards, at the same pixels in every image, elsewhere in each
// camera. Pure functions.
//
//   const Legs legs(752, 480, 3, camera_number);
//   legs.draw(radiance);              // before the sensor model: with its exposure, blur and noise
#pragma once

#include <vector>

#include "fbvins/types/image.hpp"

namespace fbvins {

class Legs {
 public:
  Legs(int width, int height, int count, int camera);

  /// Draws them over the radiance (row by row), lit by what is in view.
  void draw(std::vector<float>& radiance) const;
  /// Black where they are, white elsewhere.
  Image seen() const;

 private:
  int width_, height_;
  std::vector<float> reflectance_;  // row by row; negative where no leg is
};

}  // namespace fbvins
