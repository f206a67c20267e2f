// SPDX-License-Identifier: Apache-2.0
// Detected corners as a CSV file, one row a corner: `timestamp_ns,camera,corner,u_px,v_px`. Comments `# camera 0: 752 x 480`
// before the rows give the size of a camera's images, which corners alone do not tell. Pure functions, any thread.
//
//   Result<Detections> found = read_detections("detections.csv");
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/calibration/board_view.hpp"
#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/io/dataset_info.hpp"

namespace fbvins {

struct Detections {
  std::vector<BoardView> views;    ///< by time, then by camera; corners by index
  std::map<int, ImageSize> sizes;  ///< of cameras whose images' size is known

  int camera_count() const;  ///< one more than the largest index of a camera, whether it sees the board or not
};

Result<Detections> read_detections(const std::string& path);
/// `file` is only for messages.
Result<Detections> parse_detections(std::string_view text, const std::string& file);
std::string detections_to_csv(const Detections& detections);

}  // namespace fbvins
