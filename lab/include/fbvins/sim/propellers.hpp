// SPDX-License-Identifier: Apache-2.0
// The vehicle's own propellers in view: two blades each that turn about a hub beyond an upper corner of the image, blurred by the
// exposure, elsewhere in each camera. Pure functions.
//
//   const Propellers propellers(752, 480, 2, camera_number);
//   propellers.draw(radiance, t_s, exposure_s, line_delay_s);   // before the sensor model, as legs
#pragma once

#include <vector>

#include "fbvins/geometry/so3.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

class Propellers {
 public:
  Propellers(int width, int height, int count, int camera);

  /// Draws them over the radiance (row by row) of an exposure that is centred at t; of a rolling shutter the middle row's is.
  void draw(std::vector<float>& radiance, double t_s, double exposure_s, double line_delay_s) const;
  /// Black where a blade may be, white elsewhere.
  Image reach() const;

 private:
  struct Propeller {
    Vec2 hub;
    double turns_per_s, phase;
  };
  double radius_px(const Propeller& propeller, int x, int y) const;

  int width_, height_;
  std::vector<Propeller> propellers_;
};

}  // namespace fbvins
