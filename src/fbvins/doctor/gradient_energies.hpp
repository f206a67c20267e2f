// SPDX-License-Identifier: Apache-2.0
// How strong an image's edges are, by place, by direction, and at two scales. A scene has more edges in one direction than in
// another, but at both scales; blur along a motion takes them from the fine one. Pure function, any thread.
//
//   GradientEnergies energies = gradient_energies(pyramid);
//   energies.fine[GradientEnergies::index(cell, direction)]
#pragma once

#include <array>
#include <cstddef>

#include "fbvins/features/pyramid.hpp"

namespace fbvins {

struct GradientEnergies {
  static constexpr int kColumns = 6, kRows = 4, kCells = kColumns * kRows;
  static constexpr int kDirections = 8;  ///< over half a turn: direction d is that of d / 8 of it, 0 being the image's x
  static constexpr int kCoarse = 2;      ///< level of the pyramid
  static constexpr std::size_t index(int cell, int direction) { return static_cast<std::size_t>(cell * kDirections + direction); }
  /// Sum over a cell's pixels of the squared gradients of a direction, over the number of its pixels: (grey/px)^2 of the level.
  using Level = std::array<float, static_cast<std::size_t>(kCells* kDirections)>;
  Level fine{}, coarse{};  ///< what noise adds to the fine ones is taken away
};

GradientEnergies gradient_energies(const Pyramid& image);

}  // namespace fbvins
