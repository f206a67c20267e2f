// SPDX-License-Identifier: Apache-2.0
// Private: the pose of a tag by all of its pixels (docs/derivations/loop.md, L36). Its four corners do not give it as well: by
// the blur and the response of the sensor white spreads over black, and a tag that stands alone looks smaller than it is. Inside
// of the pattern white spreads to both sides, and tells how far. A pure function.
#pragma once

#include <optional>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/board_view.hpp"
#include "fbvins/calibration/tag_family.hpp"
#include "fbvins/camera/camera.hpp"

namespace fbvins {

struct AlignedTag {
  Pose<Cn, T> T_CnT;         ///< T as of a board with this one tag: origin at the first corner of the black square
  Mat6 covariance;           ///< of (dp in the camera, dtheta in T)
  double squared_error = 0;  ///< sum over all pixels, grey values
  double variance = 0;       ///< of such an error; larger than it is, as neighbouring pixels err alike
};

/// From a pose that is right to about a pixel. nullopt where the image does not show the pattern there: it is covered, washed
/// out, too small, or the pose moves by more than a pixel and a half.
std::optional<AlignedTag> align_tag(const ImageView& image, const Camera& camera, const TagCells& cells, double size_m,
                                    const Pose<Cn, T>& start);

}  // namespace fbvins
