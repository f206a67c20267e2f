// SPDX-License-Identifier: Apache-2.0
// The inverse depth at a pixel of the left camera, by the depth image of a sensor that is registered to it or of one that lies
// elsewhere. One instance may be used by any thread.
//
//   DepthReader reader(rig);
//   if (auto depth = reader.at(*frame.depth, px)) use(depth->value, depth->sigma);
#pragma once

#include <optional>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// Along z of the left camera, 1/m, with its standard deviation.
struct MeasuredInverseDepth {
  double value = 0, sigma = 0;
  Vec2 slope_1pm_px = Vec2::Zero();  ///< its derivative by the pixel
};

/// A depth is observed like a disparity: in a right camera so far away that what it sees of the pixel itself counts nothing.
inline constexpr double kDepthBaseline_m = 10;

/// Where that camera is, which is beside the left one.
inline Pose<B, C0> depth_observer(const Pose<B, C0>& T_BC0) { return {T_BC0.q, T_BC0 * Vec3(kDepthBaseline_m, 0, 0)}; }

class DepthReader {
 public:
  /// Of a rig with a depth sensor.
  explicit DepthReader(const StereoRig& rig);

  /// Whether a depth image is one of the sensor's: of its size.
  bool is_usable(const DepthImage* image) const {
    return image != nullptr && image->width == width_ && image->height == height_ &&
           image->mm.size() == static_cast<std::size_t>(width_) * height_;
  }
  /// Of the plane through the depths around the pixel: on a plane the inverse depth is linear in the (undistorted) image. Nothing
  /// in a hole, out of range, at the edge of the image, and where an edge of depth passes: there the sensor lies. Of a sensor
  /// that lies elsewhere nothing, either, where something nearer hides from it what the camera sees.
  std::optional<MeasuredInverseDepth> at(const DepthImage& image, const Vec2& px) const;

 private:
  DepthSensor sensor_;
  Camera left_;
  Pose<C0, C0> T_EC_;  ///< from the left camera to the frame E of a sensor that lies elsewhere
  int width_, height_;
};

}  // namespace fbvins
