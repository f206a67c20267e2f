// SPDX-License-Identifier: Apache-2.0
// A depth sensor that triangulates, with a projector (structured light or active stereo): from exact depths to what it would
// give. Noise that grows with the square of the distance and is correlated over its matching window; edges that are too
// wide; shadows beside near things, that its second eye does not see into; holes; a range. The same input gives the same output.
// One owner.
//
//   DepthModel model(options, camera, seed);
//   DepthImage depth = model.measure(exact_m, frame);
#pragma once

#include <cstdint>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

struct DepthModelOptions {
  double noise_at_1m_m = 0.003;
  double window_px = 5;
  double edge_px = 2;
  double baseline_m = 0.05;
  double hole_share = 0.01;
  double nearest_m = 0.2;
  double farthest_m = 8;
  double apart_m = 0;

  template <class V>
  void visit(V&& v) {
    v("noise_at_1m_m", noise_at_1m_m, "m", "standard deviation at one metre; it grows with the square of the distance", 1e-5,
      0.1);
    v("window_px", window_px, "px", "over which the noise is the same", 1.0, 50.0);
    v("edge_px", edge_px, "px", "by which near things appear too wide, at most", 0.0, 20.0);
    v("baseline_m", baseline_m, "m", "of the sensor's own eyes: it casts the shadows beside near things", 0.0, 1.0);
    v("hole_share", hole_share, "", "share of the image without depth, in patches", 0.0, 1.0);
    v("nearest_m", nearest_m, "m", "nearest distance", 0.01, 100.0);
    v("farthest_m", farthest_m, "m", "farthest distance", 0.02, 65.0);
    v("apart_m", apart_m, "m",
      "distance to the right of the camera, slightly turned and with a lens of its own of 640 x 480 pixels; 0: registered to the camera",
      0.0, 0.5);
  }
};

class DepthModel {
 public:
  DepthModel(const DepthModelOptions& options, const Camera& camera, std::uint64_t seed);

  /// `exact_m`: row by row, 0 where nothing is. `frame` seeds the noise.
  DepthImage measure(const std::vector<float>& exact_m, std::int64_t frame) const;

 private:
  DepthModelOptions options_;
  int width_, height_;
  double focal_px_;
  std::uint64_t seed_;
};

}  // namespace fbvins
