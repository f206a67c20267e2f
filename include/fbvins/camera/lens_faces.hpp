// SPDX-License-Identifier: Apache-2.0
// Lenses that see more than 180 degrees. No plane shows all that such a lens sees, so it is flown as up to four cameras in one
// place, its faces: one that looks ahead and three around it, which look to the sides and behind the lens' plane. Each has the
// lens' image, axes of its own (Camera::turned) and a mask that hides what the others show.
//
//   const LensFaces faces(rig);
//   Estimator estimator(faces.rig(), ...);
//   frontend.process({id, faces.spread(std::move(frame)), imu}, prior);
//
// Immutable; any thread.
#pragma once

#include <cstdint>
#include <numbers>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/calibration.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

/// Angle from a wide lens' axis to the edge of the face that looks ahead, rad.
inline constexpr double kFrontFace_rad = 55 * std::numbers::pi / 180;

/// The faces of a camera, the one that looks ahead first, with the lens' own axes; neighbours overlap by the margin that features
/// keep from a mask. The camera alone, as it is, where it does not see backwards.
std::vector<MountedCamera> faces_of(const MountedCamera& camera);

class LensFaces {
 public:
  /// All cameras of the rig keep their numbers, for the face that looks ahead; the other faces follow them.
  explicit LensFaces(const StereoRig& rig);

  const StereoRig& rig() const { return rig_; }
  /// Whether a lens has more than one face.
  bool any() const { return rig_.camera_count() > lenses_; }
  /// The camera of the rig whose lens a camera of rig() is a face of.
  int lens_of(int camera) const { return lens_of_[static_cast<std::size_t>(camera)]; }
  /// The same images, of each face its lens' one.
  StereoFrame spread(StereoFrame frame) const;
  /// The features with the numbers of their lenses; `normalised` stays in the axes of the face.
  TrackedFrame gathered(TrackedFrame frame) const;
  /// The rig's own part of a calibration of rig().
  Calibration of_lenses(Calibration calibration) const;
  /// Bits of cameras of rig() as bits of their lenses (Health::without_cameras).
  std::uint8_t lenses_of(std::uint8_t cameras) const;

 private:
  StereoRig rig_;
  Pose<B, C1> T_BC1_;
  int lenses_;
  std::vector<int> lens_of_;
};

}  // namespace fbvins
