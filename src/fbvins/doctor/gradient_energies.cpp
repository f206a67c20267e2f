// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/gradient_energies.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "fbvins/features/shi_tomasi.hpp"

namespace fbvins {
namespace {

constexpr int kStepOfFine = 3;

int direction_of(float gx, float gy) {
  constexpr auto kPerTurn = static_cast<float>(GradientEnergies::kDirections / std::numbers::pi);
  const int direction = static_cast<int>(std::lround(std::atan2(gy, gx) * kPerTurn));
  return (direction + 2 * GradientEnergies::kDirections) % GradientEnergies::kDirections;
}

GradientEnergies::Level energies_of(const PyramidLevel& image, int step) {
  GradientEnergies::Level energies{};
  std::array<int, GradientEnergies::kCells> pixels{};
  for (int y = 1; y < image.height - 1; y += step) {
    const std::uint8_t *above = image.row(y - 1), *row = image.row(y), *below = image.row(y + 1);
    for (int x = 1; x < image.width - 1; x += step) {
      const int cell =
          y * GradientEnergies::kRows / image.height * GradientEnergies::kColumns + x * GradientEnergies::kColumns / image.width;
      ++pixels[static_cast<std::size_t>(cell)];
      const float gx = 0.5F * static_cast<float>(row[x + 1] - row[x - 1]), gy = 0.5F * static_cast<float>(below[x] - above[x]);
      if (gx == 0 && gy == 0) continue;
      energies[GradientEnergies::index(cell, direction_of(gx, gy))] += gx * gx + gy * gy;
    }
  }
  for (std::size_t i = 0; i < energies.size(); ++i)
    energies[i] /= static_cast<float>(std::max(pixels[i / GradientEnergies::kDirections], 1));
  return energies;
}

}  // namespace

GradientEnergies gradient_energies(const Pyramid& image) {
  GradientEnergies out;
  if (image.levels() <= GradientEnergies::kCoarse) return out;
  out.fine = energies_of(image.level(0), kStepOfFine);
  out.coarse = energies_of(image.level(GradientEnergies::kCoarse), 1);
  const double noise = estimate_noise(image.level(0));
  for (float& energy : out.fine) energy -= static_cast<float>(noise * noise / GradientEnergies::kDirections);
  return out;
}

}  // namespace fbvins
