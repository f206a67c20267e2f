// SPDX-License-Identifier: Apache-2.0
// All tags of an AprilGrid in an image, with either border. Pure function.
//
//   std::vector<TagDetection> found = search_tags(image, reader, 36);
#pragma once

#include <vector>

#include "fbvins/calibration/tag_reading.hpp"

namespace fbvins {

/// By id; corners where edges cross, to some hundredths of a pixel, or else to about one. Ends when so many are found. A tag may
/// be there twice, and with a wrong number: whether they lie as their numbers say is another question (grid_tags.hpp).
std::vector<TagDetection> search_tags(const ImageView& image, const TagReader& reader, int enough);

}  // namespace fbvins
