// SPDX-License-Identifier: Apache-2.0
// Private to the readers and writers of calibrations: a camera's mask, by any of these keys.
//
//   mask: mask.png   8 bit, of the images' size, named relative to the calibration; black is hidden
//
//   mask_rectangles: [[x, y, width, height], ...]   px, hidden as well
//
//   mask_circles: [[x, y, radius], ...]   px, hidden as well
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {

/// The bytes of a file that a calibration names, relative to itself.
using ReadBeside = std::function<Result<std::string>(const std::string& name)>;

inline constexpr std::uint64_t kLargestMask_bytes = 64u << 20u;

/// Reads beside a calibration in a folder.
ReadBeside files_beside(const std::string& calibration_path);

/// Null where the camera has no mask, or after a complaint.
std::shared_ptr<const Mask> read_mask(YamlReader& yaml, const YAML::Node& map, const Camera& camera, const ReadBeside& read);

/// The mask as mask_rectangles, one line; nothing without a mask.
std::string mask_text(const Camera& camera, const char* indent = "");

}  // namespace fbvins
