// SPDX-License-Identifier: Apache-2.0
// Positions of the body in the building's frame as a text file (docs/maps.md, Anchors). Pure but for the file, any thread.
//
//   Result<std::vector<Anchor>> anchors = read_anchors("positions.csv");
//
// timestamp_ns,x,y,z,sx,sy,sz[,px,py,pz]: position and standard deviations in metres, and the point of the body that was
// measured. Where x and y are empty or nan, it is a height.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/types/anchor.hpp"

namespace fbvins {

/// In order of time. Every row must be right: the first that is not is an error with file and line.
Result<std::vector<Anchor>> parse_anchors(std::string_view text, const std::string& file);
Result<std::vector<Anchor>> read_anchors(const std::string& path);

}  // namespace fbvins
