// SPDX-License-Identifier: Apache-2.0
// Procedural textures: each kind of surface is generated from random numbers alone. Pure functions.
#pragma once

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/texture.hpp"

namespace fbvins {

enum class Surface {
  plaster,  ///< nearly plain
  weave,    ///< fine threads: corners that all look the same
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
  marks,    ///< dark tape with light pieces on it
  checker,  ///< a calibration board
  mat,      ///< a play mat: roads, houses, signs
  count
};

Canvas paint(Surface surface, Rng& rng);

}  // namespace fbvins
