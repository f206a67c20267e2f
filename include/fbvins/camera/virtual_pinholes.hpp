// SPDX-License-Identifier: Apache-2.0
// Lenses that see more than 180 degrees. No plane shows all that such a lens sees, so it is flown as up to four cameras in one
// place, its faces: one that looks ahead and three around it, which look to the sides and behind the lens' plane. Each has the
// part of the lens' image that shows it, axes of its own (Camera::turned) and a mask that hides what the others show.
//
//   const VirtualPinholes faces(rig);
//   Estimator estimator(faces.rig(), ...);
//   frontend.process({id, faces.spread(std::move(frame)), imu}, prior);
//
// Immutable; any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/types/calibration.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// Angle from a wide lens' axis to the edge of the face that looks ahead, rad.
inline constexpr double kFrontFace_rad = 55 * kDegree;

/// The faces of a camera, the one that looks ahead first, with the lens' own axes; neighbours overlap by the margin that features
/// keep from a mask. All have the whole image. A camera that does not see backwards has one, itself.
std::vector<MountedCamera> faces_of(const MountedCamera& camera);

class VirtualPinholes {
 public:
  /// All cameras of the rig keep their numbers, for the face that looks ahead; the other faces follow them.
  explicit VirtualPinholes(const StereoRig& rig);

  const StereoRig& rig() const { return rig_; }
  /// Whether a lens has faces.
  bool any() const { return any_; }
  /// The camera of the rig whose lens a camera of rig() is a face of.
  int lens_of(int camera) const { return lens_of_[static_cast<std::size_t>(camera)]; }
  /// The same images, of each face its part of the lens' one.
  StereoFrame spread(StereoFrame frame) const;
  /// The features with the numbers and the pixels of their lenses; `normalised` stays in the axes of the face.
  TrackedFrame gathered(TrackedFrame frame) const;
  /// Where in its lens' image the part of a camera of rig() begins, px.
  const Vec2& origin_px(int camera) const { return origins_px_[static_cast<std::size_t>(camera)]; }
  /// The rig's own part of a calibration of rig().
  Calibration of_lenses(Calibration calibration) const;
  /// Bits of cameras of rig() as bits of their lenses (Health::without_cameras).
  std::uint8_t lenses_of(std::uint8_t cameras) const;

 private:
  std::shared_ptr<const Image> part(const std::shared_ptr<const Image>& image, int camera) const;

  StereoRig lenses_, rig_;
  bool any_ = false;
  std::vector<int> lens_of_;
  std::vector<Vec2> origins_px_;
};

}  // namespace fbvins
