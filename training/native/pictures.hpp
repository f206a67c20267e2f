// SPDX-License-Identifier: Apache-2.0
// Folders of pictures, and which of them are held out.
//
//   for (const std::string& path : pictures_in(folder, Part::held_out)) { Result<Image> picture = read_picture(path); ... }
#pragma once

#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// Of every folder, by name: the first four fifths are for training, the last fifth is held out. Both are contiguous,
/// because neighbours are often frames of one film.
enum class Part { all, train, held_out };

/// PNG and JPEG below `folder`, sorted.
std::vector<std::string> pictures_in(const std::string& folder, Part part = Part::all);

Result<Image> read_picture(const std::string& path);

}  // namespace fbvins
