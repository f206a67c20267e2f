// SPDX-License-Identifier: Apache-2.0
// Where tags hang in a building, from a file (docs/maps.md, Anchors). Pure functions.
//
//   Result<TagSurvey> survey = load_tags("tags.yaml");
//
// family: tag36h11
// size_m: 0.20                        # edge of the black square
// tags:
//   - {id: 3, position_m: [4.0, 1.2, 1.6], facing_deg: 180}                # upright on a wall
//   - {id: 7, position_m: [2.0, 2.0, 0.0], orientation_wxyz: [1, 0, 0, 0]} # on the floor
//   - {id: 9}                                                              # somewhere: a landmark of the map
#pragma once

#include <map>
#include <string>

#include "fbvins/core/result.hpp"
#include "fbvins/types/anchor.hpp"

namespace fbvins {

struct TagSurvey {
  double size_m = 0.2;
  std::map<int, Pose<A, Tag>> T_AT;  ///< by number; TagAnchor::has_place() of which it is known
};

/// Of an upright tag on a wall, whose face looks in a direction of the horizontal plane, counter-clockwise from x.
Quat upright_facing(double facing_rad);

Result<TagSurvey> load_tags(const std::string& path);
/// `file` is only for messages.
Result<TagSurvey> parse_tags(const std::string& text, const std::string& file);
std::string tags_to_yaml(const TagSurvey& survey);

}  // namespace fbvins
