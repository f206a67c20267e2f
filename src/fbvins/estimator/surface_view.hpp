// SPDX-License-Identifier: Apache-2.0
// Surfaces that two frames of a depth sensor see, where there are few features: the newest frame's points lie on the surfaces of
// an earlier one, along their normals (docs/derivations/surfaces.md, D1-D5). A value.
#pragma once

#include <memory>
#include <vector>

#include "fbvins/camera/depth_reader.hpp"
#include "fbvins/estimator/factor_maker.hpp"
#include "fbvins/estimator/frame_list.hpp"
#include "fbvins/estimator/surface_factor.hpp"
#include "fbvins/types/calibration.hpp"

namespace fbvins {

class SurfaceFinder {
 public:
  /// Nothing is found with a rig without a depth sensor.
  explicit SurfaceFinder(const StereoRig& rig);

  /// Of a frame that is not in the window yet, with the earliest keyframe of the window that shows most of its points; null where
  /// none shows enough. Of its state the pose is used, to find the same places again.
  std::shared_ptr<const SurfaceFactor> find(const Frame& newest, const FrameList& window, const Calibration& calibration) const;

 private:
  struct Place {
    Vec3 p_B;        ///< in the newest body
    double sigma_m;  ///< along the ray
  };
  std::vector<Place> places(const DepthImage& depth, const Pose<B, C0>& T_BC) const;
  std::vector<SurfaceDistance> distances(const std::vector<Place>& places, const Frame& newest, const Frame& reference,
                                         const Pose<B, C0>& T_BC) const;

  Camera camera_;
  std::optional<DepthReader> reader_;
};

/// Where there are too few landmarks.
class SurfaceMaker : public FactorMaker {
 public:
  explicit SurfaceMaker(const StereoRig& rig) : finder_(rig) {}
  std::vector<std::shared_ptr<const Factor>> make(const NewFrame& frame) override;

 private:
  SurfaceFinder finder_;
};

}  // namespace fbvins
