// SPDX-License-Identifier: Apache-2.0
// Lists with a value for each camera, by number. Cameras that are missing at the end have a value like a new one.
#pragma once

#include <cstddef>
#include <vector>

namespace fbvins {

/// Cameras of a rig at most.
inline constexpr int kMostCameras = 8;

template <class T>
const T& of_camera(const std::vector<T>& values, int camera) {
  if (const auto at = static_cast<std::size_t>(camera); at < values.size()) return values[at];
  static const T none{};
  return none;
}

/// The list grows to have it.
template <class T>
T& of_camera(std::vector<T>& values, int camera) {
  const auto at = static_cast<std::size_t>(camera);
  if (at >= values.size()) values.resize(at + 1);
  return values[at];
}

}  // namespace fbvins
