// SPDX-License-Identifier: Apache-2.0
// Private to mocap: where the poses are in the tables that motion-capture systems export. Pure functions, any thread.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/io/csv.hpp"

namespace fbvins {

enum class RotationKind {
  quaternion,         ///< x y z w
  rotation_vector,    ///< Vicon's helical angles: axis times angle
  matrix_of_columns,  ///< Qualisys: nine elements, column after column
};
std::size_t columns_of(RotationKind kind);

struct BodyColumns {
  std::string name;
  std::size_t position = 0, rotation = 0;  ///< their first columns
};

struct MarkerLayout {
  std::string format;
  char separator = ',';
  std::size_t columns = 0;          ///< that a row can have
  std::optional<std::size_t> time;  ///< column of seconds; else frame / rate
  std::size_t frame = 0;            ///< column of the frame's number
  double rate_hz = 0;               ///< where there is no time
  double metres = 1, radians = 1;   ///< of a file's unit
  bool y_up = false;
  RotationKind rotation = RotationKind::quaternion;
  std::vector<BodyColumns> bodies;
  std::vector<CsvLine> rows;  ///< the data
};

/// Nullopt for text of another kind; an error where it is one of these and cannot be used.
std::optional<Result<MarkerLayout>> marker_layout(std::string_view text, const std::string& file);

}  // namespace fbvins
