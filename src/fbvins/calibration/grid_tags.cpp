// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/grid_tags.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>

namespace fbvins {
namespace {

/// Tags so many places apart in the grid are compared, and their distance may be wrong by this part of what is expected: less
/// than the place of a neighbour, more than what perspective and the lens bend.
constexpr int kFarthest = 3;
constexpr double kLargestError = 0.3;
/// A tag's edges against another's: a wrong number usually turns the tag, too.
constexpr double kLargestChange = 0.7;
constexpr int kLeastUnlike = 3;  ///< tags that show that the board is another one

using Mat2 = Eigen::Matrix2d;

/// A tag as an affine map of its square.
struct Square {
  Vec2 centre;
  Mat2 edges;  ///< along a row, along a column of the board; px a tag
};

Square square_of(const TagDetection& tag) {
  const auto& c = tag.corners;
  Square out;
  out.centre = 0.25 * (c[0] + c[1] + c[2] + c[3]);
  out.edges.col(0) = 0.5 * (c[1] + c[2] - c[0] - c[3]);
  out.edges.col(1) = 0.5 * (c[3] + c[2] - c[0] - c[1]);
  return out;
}

/// Whether one lies beside the other as their numbers say. The mean of both maps: what perspective changes from one to the other
/// cancels.
bool agree(const Board& board, const TagDetection& one, const TagDetection& other) {
  const int columns = other.id % board.columns - one.id % board.columns, rows = other.id / board.columns - one.id / board.columns;
  if ((columns == 0 && rows == 0) || std::abs(columns) > kFarthest || std::abs(rows) > kFarthest) return false;
  const Square a = square_of(one), b = square_of(other);
  const Mat2 mean = 0.5 * (a.edges + b.edges);
  if (!((a.edges - b.edges).norm() < kLargestChange * mean.norm()) || !(std::abs(mean.determinant()) > 1)) return false;
  const Vec2 expected = (1 + board.spacing) * Vec2(columns, rows), seen = mean.inverse() * (b.centre - a.centre);
  return (seen - expected).norm() < kLargestError * expected.norm();
}

/// For each tag the number of the group of those that agree, by way of others too; -1 for one alone.
std::vector<int> groups_of(const Board& board, const std::vector<TagDetection>& tags) {
  std::vector<int> group(tags.size());
  std::iota(group.begin(), group.end(), 0);
  const auto count = static_cast<int>(tags.size());
  for (int i = 0; i < count; ++i)
    for (int k = i + 1; k < count; ++k)
      if (group[i] != group[k] && agree(board, tags[i], tags[k])) std::ranges::replace(group, group[k], group[i]);
  const std::vector<int> joined = group;
  for (int& g : group)
    if (std::ranges::count(joined, g) == 1) g = -1;
  return group;
}

/// Tags of one border.
GridTags of_border(const Board& board, const std::vector<TagDetection>& found) {
  GridTags out;
  const int count = board.columns * board.rows;
  std::vector<TagDetection> own, exact;
  for (const TagDetection& tag : found) {
    if (tag.id >= count) ++out.foreign;
    else own.push_back(tag);
  }
  if (out.foreign == 1) out.foreign = 0;  // by luck
  std::vector<int> group = groups_of(board, own);
  int largest = 0;
  for (const int g : group)
    if (g >= 0) largest = std::max(largest, static_cast<int>(std::ranges::count(group, g)));
  const auto without_fault = static_cast<int>(std::ranges::count(own, 0, &TagDetection::wrong_cells));
  const bool unlike = count == 1 || (without_fault >= kLeastUnlike && without_fault > 2 * largest);
  if (unlike)
    for (std::size_t i = 0; i < own.size(); ++i) group[i] = own[i].wrong_cells == 0 ? 0 : -1;
  std::map<int, int> times;
  for (std::size_t i = 0; i < own.size(); ++i) times[own[i].id] += group[i] >= 0;
  for (const auto& [id, seen] : times) out.twice += seen > 1;
  for (std::size_t i = 0; i < own.size(); ++i)
    if (group[i] >= 0 && times[own[i].id] == 1) out.tags.push_back(own[i]);
  return out;
}

}  // namespace

GridTags tags_of_grid(const Board& board, const std::vector<TagDetection>& found) {
  GridTags best;
  for (const int border : {kKalibrBorder, kLibraryBorder}) {
    std::vector<TagDetection> tags;
    std::ranges::copy_if(found, std::back_inserter(tags), [&](const TagDetection& tag) { return tag.border == border; });
    GridTags seen = of_border(board, tags);
    const auto weight = [](const GridTags& of) { return of.tags.size() + static_cast<std::size_t>(of.foreign + of.twice); };
    if (weight(seen) > weight(best)) best = std::move(seen);
  }
  return best;
}

}  // namespace fbvins
