// SPDX-License-Identifier: Apache-2.0
// How far the turns between the frames of a window are from those of the readings between them, added up. A wrong rate that is
// too small to be seen in one image leaves its mark here (docs/derivations/integrity.md, I4c). A pure function.
#pragma once

#include "fbvins/core/time.hpp"
#include "fbvins/estimator/frame_list.hpp"

namespace fbvins {

struct WindowTurns {
  Vec3 off_G = Vec3::Zero();  ///< the window's turns minus the readings', rad
  double sigma_rad = 0;       ///< of each of the three, by the readings' noise
  double turned_rad = 0;      ///< angles of the turns, added up
  Duration span;              ///< of the readings
};

WindowTurns turns_of(const FrameList& frames);

}  // namespace fbvins
