// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/grid_fill.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <optional>

#include "fbvins/calibration/corner_refine.hpp"

namespace fbvins {
namespace {

constexpr int kLeastNeighbours = 2, kMostNeighbours = 5, kGridReach = 2;  ///< tags, and places in the grid between them
constexpr double kSmallestFilled_px = 12, kLargestFillRadius_px = 6;
/// A corner is on the wrong crossing of edges where it bends its tag so far, in edges; seen of so many tags.
constexpr double kLargestBend = 0.15;
constexpr std::size_t kLeastTagsOfBent = 4;
constexpr int kMostWrongCells = 3;  ///< of 36: eleven differ between two tags

/// From the board's plane to pixels.
Vec2 mapped(const Mat3& H, const Vec2& at) { return Vec3(H * at.homogeneous()).hnormalized(); }

/// By the corners of tags, in units of the tag about its middle; nullopt where they do not determine it.
std::optional<Mat3> homography(const Board& board, const std::vector<const TagDetection*>& tags, const Vec2& middle) {
  Vec2 mean = Vec2::Zero();
  for (const TagDetection* tag : tags)
    for (const Vec2& corner : tag->corners) mean += corner / (4.0 * static_cast<double>(tags.size()));
  const double scale = std::max(1.0, (tags[0]->corners[0] - tags[0]->corners[2]).norm());
  Eigen::MatrixXd A(8 * tags.size(), 9);
  Eigen::Index row = 0;
  for (const TagDetection* tag : tags)
    for (int k = 0; k < 4; ++k) {
      const Vec2 p = (board.corner(4 * tag->id + k).head<2>() - middle) / board.size_m, q = (tag->corners[k] - mean) / scale;
      const Vec3 h = p.homogeneous();
      A.row(row++) << h.transpose(), 0, 0, 0, -q.x() * h.transpose();
      A.row(row++) << 0, 0, 0, h.transpose(), -q.y() * h.transpose();
    }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeFullV);
  const Eigen::VectorXd v = svd.matrixV().col(8);
  Mat3 H, back;
  H << v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8];
  back << scale, 0, mean.x(), 0, scale, mean.y(), 0, 0, 1;
  const Mat3 out = back * H;
  return std::abs(out(2, 2)) > 1e-12 && out.allFinite() ? std::optional(out) : std::nullopt;
}

std::vector<const TagDetection*> nearest(const Board& board, int id, const std::vector<TagDetection>& tags) {
  std::vector<std::pair<int, const TagDetection*>> near;
  for (const TagDetection& tag : tags) {
    const int columns = std::abs(tag.id % board.columns - id % board.columns),
              rows = std::abs(tag.id / board.columns - id / board.columns);
    if (columns <= kGridReach && rows <= kGridReach) near.emplace_back(columns * columns + rows * rows, &tag);
  }
  std::ranges::stable_sort(near, {}, [](const auto& entry) { return entry.first; });
  std::vector<const TagDetection*> out;
  for (const auto& [distance, tag] : near)
    if (out.size() < kMostNeighbours) out.push_back(tag);
  return out;
}

/// Where those beside it say that a tag's corners are.
std::optional<Quad> expected_corners(const Board& board, int id, const std::vector<TagDetection>& tags) {
  const std::vector<const TagDetection*> near = nearest(board, id, tags);
  if (near.size() < kLeastNeighbours) return std::nullopt;
  const auto H = homography(board, near, board.corner(4 * id).head<2>());
  if (!H) return std::nullopt;
  return Quad{mapped(*H, {0, 0}), mapped(*H, {1, 0}), mapped(*H, {1, 1}), mapped(*H, {0, 1})};
}

double shortest_side_px(const Quad& quad) {
  double side_px = 1e9;
  for (std::size_t k = 0; k < 4; ++k) side_px = std::min(side_px, (quad[k] - quad[(k + 1) % 4]).norm());
  return side_px;
}

std::optional<TagDetection> look_for(const Board& board, int id, const TagReader& reader, const ImageView& image,
                                     const std::vector<TagDetection>& tags) {
  const auto expected = expected_corners(board, id, tags);
  if (!expected) return std::nullopt;
  const double side_px = shortest_side_px(*expected);
  if (!(side_px > kSmallestFilled_px)) return std::nullopt;
  TagDetection out{id, tags[0].border, 0, {}};
  const double border = static_cast<double>(out.border) / cells_across(out.border);
  const double radius_px = std::clamp(side_px * std::min(border, board.spacing), 2.0, kLargestFillRadius_px);
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec2 at = (*expected)[k];
    const auto corner = refine_corner(image, at, (*expected)[(k + 1) % 4] - at, (*expected)[(k + 3) % 4] - at, radius_px);
    if (!corner) return std::nullopt;
    out.corners[k] = *corner;
  }
  const auto wrong = reader.wrong_cells(image, out.corners, id, out.border);
  if (!wrong || *wrong > kMostWrongCells) return std::nullopt;
  out.wrong_cells = *wrong;
  return out;
}

/// Adds what is found beside the others, and beside that.
void fill(const Board& board, const TagReader& reader, const ImageView& image, std::vector<TagDetection>& tags) {
  for (bool more = true; more;) {
    std::vector<TagDetection> found;
    for (int id = 0; id < board.columns * board.rows; ++id)
      if (std::ranges::find(tags, id, &TagDetection::id) == tags.end())
        if (const auto tag = look_for(board, id, reader, image, tags)) found.push_back(*tag);
    more = !found.empty();
    tags.insert(tags.end(), found.begin(), found.end());
    std::ranges::stable_sort(tags, {}, &TagDetection::id);
  }
}

/// How far a quadrangle is from a parallelogram.
Vec2 skew_of(const Quad& quad) { return quad[0] - quad[1] + quad[2] - quad[3]; }

/// Takes away the tag that is farthest from the shape that those beside it give it, if it is too far: lenses bend a board, but
/// not a tag of it alone.
bool take_bent(const Board& board, std::vector<TagDetection>& tags) {
  double worst = kLargestBend;
  auto bent = tags.end();
  for (auto tag = tags.begin(); tag != tags.end(); ++tag) {
    std::vector<TagDetection> others = tags;
    std::erase_if(others, [&](const TagDetection& other) { return other.id == tag->id; });
    const auto expected = expected_corners(board, tag->id, others);
    if (!expected) continue;
    const double part = (skew_of(*expected) - skew_of(tag->corners)).norm() / shortest_side_px(*expected);
    if (part > worst) worst = part, bent = tag;
  }
  if (bent == tags.end()) return false;
  tags.erase(bent);
  return true;
}

}  // namespace

std::vector<TagDetection> with_missing_tags(const Board& board, const TagReader& reader, const ImageView& image,
                                            std::vector<TagDetection> tags) {
  if (tags.size() < kLeastNeighbours) return tags;
  fill(board, reader, image, tags);
  bool bent = false;
  while (tags.size() > kLeastTagsOfBent && take_bent(board, tags)) bent = true;
  if (bent) fill(board, reader, image, tags);
  return tags;
}

}  // namespace fbvins
