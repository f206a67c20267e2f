// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/grid_fill.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "fbvins/calibration/corner_refine.hpp"

namespace fbvins {
namespace {

constexpr int kLeastNeighbours = 2, kMostNeighbours = 5, kGridReach = 2;  ///< tags, and places in the grid between them
constexpr int kFillRounds = 3;                                            ///< what is found leads to the next
constexpr double kSmallestFilled_px = 12, kLargestFillRadius_px = 6;
constexpr int kLeastTagContrast = 20;  ///< grey values between the border and the gap
constexpr int kMostWrongCells = 3;     ///< of 36: eleven differ between two tags

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

std::optional<double> grey_at(const ImageView& image, const Vec2& at) {
  if (!(at.x() >= 1 && at.y() >= 1 && at.x() < image.width - 2 && at.y() < image.height - 2)) return std::nullopt;
  const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y());
  const double fx = at.x() - x, fy = at.y() - y;
  const std::uint8_t *above = image.row(y) + x, *below = image.row(y + 1) + x;
  return (1 - fy) * ((1 - fx) * above[0] + fx * above[1]) + fy * ((1 - fx) * below[0] + fx * below[1]);
}

/// Whether the cells between these corners are the tag's. By four corners, in units of the tag from its first corner.
bool shows(const ImageView& image, const Mat3& H, const TagCells& cells, int border, double spacing) {
  const int across = cells_across(border);
  const double first = border, edge = 0.5 * border, gap = std::min(0.8, 0.5 * spacing * across);
  const auto sample = [&](double column, double row) { return grey_at(image, mapped(H, Vec2(column, row) / across)); };
  // Black in the middle of the border; white around the tag.
  double black = 0, white = 0;
  int count = 0;
  for (int i = 0; i < 6; ++i) {
    const double along = first + i + 0.5;
    for (const auto& [in_x, in_y, out_x, out_y] :
         {std::array{along, edge, along, -gap}, std::array{along, across - edge, along, across + gap},
          std::array{edge, along, -gap, along}, std::array{across - edge, along, across + gap, along}}) {
      const auto inside = sample(in_x, in_y), outside = sample(out_x, out_y);
      if (!inside || !outside) return false;
      black += *inside, white += *outside, ++count;
    }
  }
  black /= count, white /= count;
  if (!(white - black > kLeastTagContrast)) return false;
  int wrong = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) {
      // Rows of a tag count from its top, the board's axes upwards.
      const auto grey = sample(first + column + 0.5, across - (first + row + 0.5));
      if (!grey) return false;
      wrong += (*grey < 0.5 * (black + white)) != cells[static_cast<std::size_t>(row + 1)][static_cast<std::size_t>(column + 1)];
    }
  return wrong <= kMostWrongCells;
}

std::optional<TagDetection> look_for(const Board& board, int id, const TagCells& cells, const ImageView& image,
                                     const std::vector<TagDetection>& tags) {
  const std::vector<const TagDetection*> near = nearest(board, id, tags);
  if (near.size() < kLeastNeighbours) return std::nullopt;
  const Vec2 first = board.corner(4 * id).head<2>();
  const auto H = homography(board, near, first);
  if (!H) return std::nullopt;
  constexpr std::array<std::array<double, 2>, 4> kCorners{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  TagDetection out{id, near[0]->border, 0, {}};
  std::array<Vec2, 4> expected;
  for (int k = 0; k < 4; ++k) expected[k] = mapped(*H, Vec2(kCorners[k][0], kCorners[k][1]));
  double side_px = 1e9;
  for (int k = 0; k < 4; ++k) side_px = std::min(side_px, (expected[k] - expected[(k + 1) % 4]).norm());
  if (!(side_px > kSmallestFilled_px)) return std::nullopt;
  const double border = static_cast<double>(out.border) / cells_across(out.border);
  const double radius_px = std::clamp(side_px * std::min(border, board.spacing), 2.0, kLargestFillRadius_px);
  for (int k = 0; k < 4; ++k) {
    const auto corner =
        refine_corner(image, expected[k], expected[(k + 1) % 4] - expected[k], expected[(k + 3) % 4] - expected[k], radius_px);
    if (!corner) return std::nullopt;
    out.corners[k] = *corner;
  }
  const auto own = homography(board, {&out}, first);
  return own && shows(image, *own, cells, out.border, board.spacing) ? std::optional(out) : std::nullopt;
}

}  // namespace

std::vector<TagDetection> with_missing_tags(const Board& board, const std::vector<TagCells>& cells, const ImageView& image,
                                            std::vector<TagDetection> tags) {
  const auto count = static_cast<std::size_t>(board.columns * board.rows);
  for (int round = 0; round < kFillRounds && tags.size() >= kLeastNeighbours && tags.size() < count; ++round) {
    std::vector<TagDetection> found;
    for (int id = 0; id < board.columns * board.rows; ++id)
      if (std::ranges::find(tags, id, &TagDetection::id) == tags.end())
        if (const auto tag = look_for(board, id, cells[static_cast<std::size_t>(id)], image, tags)) found.push_back(*tag);
    if (found.empty()) break;
    tags.insert(tags.end(), found.begin(), found.end());
    std::ranges::stable_sort(tags, {}, &TagDetection::id);
  }
  return tags;
}

}  // namespace fbvins
