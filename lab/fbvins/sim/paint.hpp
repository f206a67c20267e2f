// SPDX-License-Identifier: Apache-2.0
// Painters of textures: each draws one kind of surface from random numbers alone. Pure functions.
#pragma once

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/texture.hpp"

namespace fbvins {

enum class Surface {
  plaster,  ///< nearly plain
  weave,    ///< fine threads, the same everywhere: corners that cannot be told apart
  concrete,
  wood,
  brick,
  tiles,
  carpet,
  page,     ///< text and pictures
  poster,   ///< shapes and large letters
  picture,  ///< like a photograph: structure at all scales
  cardboard,
  metal,
  books,
  cloth,
  panel,    ///< switches, lamps and labels of a machine
  marks,    ///< dark tape with light scraps on it
  checker,  ///< a calibration board
  mat,      ///< a play mat: roads, houses, signs
  count
};

Canvas paint(Surface surface, Rng& rng);

}  // namespace fbvins
