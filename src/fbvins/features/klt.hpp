// SPDX-License-Identifier: Apache-2.0
// Pyramidal Lucas-Kanade with gain and offset, inverse-compositional (Baker & Matthews, IJCV 2004).
//
// Around the feature the image is modelled as  I(x + d) = a * (T(x) + grad T(x)^T s) + b.  This is linear in
// (a*s, a, b), so one iteration is four weighted sums over the patch times a constant matrix: exact
// invariance to exposure and gain costs nothing, and no residual image is formed. d <- d - s.
// A template is cut once per feature and frame, and serves the next frame, the other camera and the
// backward check. Thread rule: functions without state.
//
//   KltTemplate patch;
//   patch.cut(pyramid_then, px, 0, 3);
//   KltResult found = klt_align(patch, pyramid_now, predicted_px, 3, 0);
//   if (found.ok()) use(found.px);
#pragma once

#include <array>
#include <cstdint>

#include "fbvins/features/pyramid.hpp"
#include "fbvins/geometry/so3.hpp"

namespace fbvins {

/// Side of the square patch. Even, so that the feature lies between the four central samples.
inline constexpr int kKltPatch = 16;
/// Distance from a feature to the farthest pixel its template reads, rounded up.
inline constexpr int kKltReach = kKltPatch / 2 + 2;
/// A feature nearer to the image's edge than this has no whole patch.
inline constexpr double kPatchBorder_px = kKltReach - 2;

/// How fast the weights of the samples fall with the distance from the feature. At the edge of a thing a wide patch shows what is
/// behind it as well, and its displacement is a mean of both; a narrow one is for the last step of a match that is nearly right.
enum class KltWindow : std::uint8_t { wide, narrow };

/// What one pyramid level needs of the template: the projections onto gradient and grey value.
struct alignas(64) KltLevelTemplate {
  static constexpr int kSamples = kKltPatch * kKltPatch;
  float wgx[kSamples], wgy[kSamples], wt[kSamples];  ///< window weight times the part orthogonal to 1 (and to T)
  float ihxx = 0, ihxy = 0, ihyy = 0;                ///< inverse of the 2x2 normal matrix
  float ctx = 0, cty = 0;                            ///< regression of the gradients on T
  float energy = 0;                                  ///< weighted sum of (T - mean T)^2
  KltWindow window = KltWindow::wide;
  bool valid = false;
};

/// The pixels around a feature in the frame where it was first seen well. Aligning to them in every later
/// frame, through the warp that the motion since then predicts, keeps a long track from drifting.
struct KltReference {
  static constexpr int kSide = 48;
  std::array<std::uint8_t, kSide * kSide> pixels;
  Vec2 centre = Vec2::Zero();  ///< of the feature, in the block

  /// Copies the block around `px`; false when it leaves the padded image.
  bool take(const Pyramid& pyramid, const Vec2& px);
};

struct KltTemplate {
  std::array<KltLevelTemplate, kMaxPyramidLevels> levels;
  int coarsest = -1;  ///< level that was cut

  /// Cuts the patch around `px` (level-0 pixels) from levels finest..coarsest; there are no coarser ones then.
  /// False when the feature is too close to the border or the finest patch has no texture in some direction.
  bool cut(const Pyramid& pyramid, const Vec2& px, int finest, int coarsest, KltWindow window = KltWindow::wide);
  /// Cuts the levels up to `coarsest` that are not there yet, from where the others are of: most are never asked for.
  void extend(const Pyramid& pyramid, const Vec2& px, int coarsest);
  /// Level 0 from a reference: an offset d from the feature in the new image shows what the reference has at
  /// J_reference_now * d. False when the warp leaves the block or the patch has no texture.
  bool cut_warped(const KltReference& reference, const Mat2& J_reference_now);
};

enum class KltStatus { ok, outside, diverged, poor_match };

struct KltResult {
  Vec2 px = Vec2::Zero();  ///< level-0 pixels
  float correlation = 0;   ///< weighted normalised cross-correlation at the finest level
  float gain = 1;          ///< contrast relative to the template
  float residual = 0;      ///< rms of I - aT - b, grey values
  int iterations = 0;      ///< over all levels
  KltStatus status = KltStatus::outside;

  bool ok() const { return status == KltStatus::ok; }
};

/// Last step of a converged alignment; and of the backward check, which only asks whether the feature comes back near its start.
inline constexpr double kConverged_px = 0.03, kConvergedCheck_px = 0.1;
/// Largest error of an alignment there and back again, and largest disagreement between the newest patch and the reference:
/// a feature beyond it has drifted and is dropped.
inline constexpr double kForwardBackward_px = 0.7, kMaxCreep_px = 0.7;
/// Coarsest level of an alignment from a position that is known to a pixel or two.
inline constexpr int kNearLevel = 1;

/// Finds the template in `image`, starting at `start_px`, from level `coarsest` down to `finest`. A match is good where it
/// correlates with the template, or what differs is no more than noise. `converged_px`: last step on the finest level.
KltResult klt_align(const KltTemplate& patch, const Pyramid& image, const Vec2& start_px, int coarsest, int finest,
                    double converged_px = kConverged_px);

/// Weighted normalised cross-correlation of a template with the image at one place of level `level`
/// (position in pixels of that level); -1 outside the image.
float klt_correlation(const KltLevelTemplate& patch, const PyramidLevel& level, const Vec2& px);

/// The same at the nearest place, at most half a pixel off in x and y, that needs no interpolation: for a search.
float klt_correlation_about(const KltLevelTemplate& patch, const PyramidLevel& level, const Vec2& px);

}  // namespace fbvins
