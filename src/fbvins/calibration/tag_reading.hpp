// SPDX-License-Identifier: Apache-2.0
// The cells between four corners of a tag in an image: which tag they are, or whether they are a given one's. Pure functions of a
// value; any thread.
//
//   const TagReader reader = *TagReader::create(board.spacing);
//   std::optional<TagDetection> tag = reader.read(image, corners);
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fbvins/calibration/dark_squares.hpp"
#include "fbvins/calibration/tag_family.hpp"

namespace fbvins {

class TagReader {
 public:
  /// `spacing`: the white around a tag, as a part of its edge. An error in a build without tags.
  static Result<TagReader> create(double spacing);

  /// Of all tags of the family, with either border and turned as it may be; with up to two wrong cells, of which eleven differ
  /// between tags. The corners of what is returned begin at the tag's own first one.
  std::optional<TagDetection> read(const ImageView& image, const Quad& corners) const;

  /// Cells that are not as the tag's; nullopt where nothing like a tag is there.
  std::optional<int> wrong_cells(const ImageView& image, const Quad& corners, int id, int border) const;

 private:
  TagReader(std::vector<std::uint64_t> codes, double spacing) : codes_(std::move(codes)), spacing_(spacing) {}

  std::vector<std::uint64_t> codes_;  ///< of each id: 36 cells by rows from the top, the first one highest, 1 is black
  double spacing_;
};

}  // namespace fbvins
