// SPDX-License-Identifier: Apache-2.0
// Gradient energy of an image by cell, by direction, and at two scales. A scene may have more edges in one direction than in
// another, but then at both scales; motion blur weakens those across the motion at the fine one. Pure function, any thread.
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
  static constexpr int kDirections = 8;  ///< direction d is at d / 8 of half a turn from the image's x axis
  static constexpr int kCoarse = 2;      ///< level of the pyramid
  static constexpr std::size_t index(int cell, int direction) { return static_cast<std::size_t>(cell * kDirections + direction); }
  /// Sum of a cell's squared gradients in a direction over the number of its pixels: (grey/px)^2, px of the level.
  using Level = std::array<float, static_cast<std::size_t>(kCells* kDirections)>;
  Level fine{}, coarse{};  ///< the mean energy of noise is subtracted from `fine`
};

GradientEnergies gradient_energies(const Pyramid& image);

}  // namespace fbvins
