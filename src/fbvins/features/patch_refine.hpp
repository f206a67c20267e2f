// SPDX-License-Identifier: Apache-2.0
// Sub-pixel positions for descriptor matches: the patch where a track began (its reference) is warped by the
// motion since then and aligned, invariant to gain and offset, from the matched keypoint on. All positions of a
// track are thus measured against the same pixels and agree with one another to a fraction of a pixel.
// Values; a PatchRefiner holds scratch memory and serves one thread at a time.
//
//   PatchReference reference;
//   reference.take(pyramid_then, px, camera, normalised);
//   reference.carry(R_now_then, depth_now / depth_then);
//   KltResult fine = refiner.refine(reference, pyramid_now, keypoint.pixel, camera, normalised_guess);
#pragma once

#include "fbvins/camera/camera.hpp"
#include "fbvins/features/klt.hpp"

namespace fbvins {

/// A patch of an image and its warp to the present view: a small plane that faced the camera then.
struct PatchReference {
  KltReference patch;
  Mat2 J_normalised_pixel_then = Mat2::Identity();
  Mat3 R_now_then = Mat3::Identity();  ///< rays of the camera then -> now
  double depth_ratio = 1;              ///< depth now / depth then

  /// False when the patch leaves the image; the reference is unusable then.
  bool take(const Pyramid& pyramid, const Vec2& px, const Camera& camera, const Vec2& normalised);
  /// The camera moved on: rotation from the frame before to now, depth now / depth before.
  void carry(const Mat3& R_now_before, double depth_factor);
  /// d(pixel now)/d(pixel then) at the patch.
  Mat2 warp(const Camera& camera, const Vec2& normalised_now) const;
};

/// Correlation with the reference below which a new one is taken.
inline constexpr double kReferenceCorrelation = 0.85;

class PatchRefiner {
 public:
  /// Aligns the reference from `start_px` on. status is outside when the warp is too strong for the patch.
  KltResult refine(const PatchReference& reference, const Pyramid& image, const Vec2& start_px, const Camera& camera,
                   const Vec2& normalised_guess);
  /// Whether a result may be used: converged, similar, and not far from where it started.
  /// `scale`: of the keypoint's level, pixels.
  static bool accept(const KltResult& result, const Vec2& start_px, double scale, double min_correlation = kReferenceCorrelation);

 private:
  KltTemplate warped_;
};

}  // namespace fbvins
