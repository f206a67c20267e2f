// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/camera_start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fbvins/calibration/board_pose.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/calibration/rig_adjustment.hpp"
#include "fbvins/calibration/view_choice.hpp"

namespace fbvins {
namespace {

constexpr int kStartViews = 24, kTableViews = 12, kTableCorners = 40, kBestOfTable = 4, kJudgedViews = 120;
constexpr double kUnfit = std::numeric_limits<double>::infinity();

/// Shapes that a model's lenses have; the focal length near the axis is the given one.
std::vector<LensModel> shapes(const std::string& model, double f, const Vec2& c) {
  if (model == "ds") {
    const auto shape = [&](double xi, double alpha) { return DoubleSphere{f * (1 + xi), f * (1 + xi), c.x(), c.y(), xi, alpha}; };
    return {shape(0, 0.5), shape(-0.2, 0.6), shape(0.3, 0.4)};
  }
  if (model == "eucm")
    return {ExtendedUnified{f, f, c.x(), c.y(), 0.5, 1}, ExtendedUnified{f, f, c.x(), c.y(), 0.65, 1.05},
            ExtendedUnified{f, f, c.x(), c.y(), 0.2, 1}};
  if (model == "omni-radtan") {
    const auto shape = [&](double xi) { return UnifiedRadtan{f * (1 + xi), f * (1 + xi), c.x(), c.y(), xi}; };
    return {shape(0.5), shape(1), shape(1.8)};
  }
  const auto plain = plain_lens(model, f, c);
  return plain ? std::vector<LensModel>{*plain} : std::vector<LensModel>{};
}

std::vector<BoardCorner> thinned_corners(const std::vector<BoardCorner>& corners) {
  std::vector<BoardCorner> out;
  const std::size_t step = std::max<std::size_t>(1, corners.size() / kTableCorners);
  for (std::size_t i = 0; i < corners.size(); i += step) out.push_back(corners[i]);
  return out;
}

/// Median over the views of what a lens leaves unexplained.
double unexplained_px(const Camera& camera, const Board& board, const std::vector<std::vector<BoardCorner>>& views) {
  std::vector<double> each;
  for (const auto& corners : views) {
    const auto posed = find_board_pose(camera, board, corners);
    each.push_back(posed ? posed->rms_px : 1e4);
  }
  std::ranges::sort(each);
  return each[each.size() / 2];
}

std::vector<RigFrame> posed_frames(const Camera& camera, const Board& board, const std::vector<BoardView>& views) {
  std::vector<RigFrame> out;
  for (const BoardView& view : views) {
    const auto posed = find_board_pose(camera, board, view.corners);
    if (!posed) continue;
    RigFrame frame{view.t, {{0, {}}}, {posed->T_CkT.q, posed->T_CkT.p}};
    for (const BoardCorner& corner : view.corners)
      frame.views[0].corners.push_back({corner.index, board.corner(corner.index), corner.pixel});
    out.push_back(std::move(frame));
  }
  return out;
}

/// Of all corners' distances, as a deviation of a coordinate.
double robust_rms(const RigAdjustment& adjustment) {
  std::vector<double> sizes;
  for (const RigFrame& frame : adjustment.frames())
    for (const SeenCorner& corner : frame.views[0].corners) sizes.push_back(adjustment.residual(frame, frame.views[0], corner).norm());
  if (sizes.empty()) return kUnfit;
  std::ranges::nth_element(sizes, sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2));
  return sizes[sizes.size() / 2] / std::sqrt(2 * std::log(2.0));
}

/// Adjusted to the views; poses are found anew once the lens is better known.
std::optional<CameraStart> adjusted(Camera camera, const Board& board, const std::vector<BoardView>& views) {
  double rms_px = kUnfit;
  for (const double spread_px : {4.0, 1.0}) {
    std::vector<RigFrame> frames = posed_frames(camera, board, views);
    if (2 * frames.size() < views.size() || frames.size() < 3) return std::nullopt;
    RigAdjustment adjustment({{camera.model(), {}}}, std::move(frames));
    if (!adjustment.solve({.spread_px = spread_px, .max_iterations = 40}).usable) return std::nullopt;
    camera = Camera(adjustment.cameras()[0].lens, camera.width(), camera.height());
    rms_px = robust_rms(adjustment);
  }
  return CameraStart{camera, rms_px};
}

/// Root mean square of the residuals in views whose poses are fitted with the lens as it is; the largest per cent is left out.
double predicted_px(const Camera& camera, const Board& board, const std::vector<BoardView>& views) {
  RigAdjustment adjustment({{camera.model(), {}}}, posed_frames(camera, board, views));
  if (2 * adjustment.frames().size() < views.size()) return kUnfit;
  if (!adjustment.solve({.spread_px = 2, .poses_only = true}).usable) return kUnfit;
  std::vector<double> squares;
  for (const RigFrame& frame : adjustment.frames())
    for (const SeenCorner& corner : frame.views[0].corners)
      squares.push_back(adjustment.residual(frame, frame.views[0], corner).squaredNorm());
  std::ranges::sort(squares);
  squares.resize(squares.size() - squares.size() / 100);
  double sum = 0;
  for (const double square : squares) sum += square;
  return std::sqrt(0.5 * sum / static_cast<double>(std::max<std::size_t>(1, squares.size())));
}

double held_out_px(const std::string& model, const ImageSize& size, const Board& board,
                   const std::vector<std::vector<BoardView>>& halves) {
  double square = 0;
  for (const int fitted : {0, 1}) {
    const auto start = start_camera(model, size, board, halves[fitted]);
    const auto lens = start ? adjusted(start->camera, board, halves[fitted]) : std::nullopt;
    const double error_px = lens ? predicted_px(lens->camera, board, halves[1 - fitted]) : kUnfit;
    square += 0.5 * error_px * error_px;
  }
  return std::sqrt(square);
}

}  // namespace

std::optional<CameraStart> start_camera(const std::string& model, const ImageSize& size, const Board& board,
                                        const std::vector<BoardView>& views) {
  const std::vector<BoardView> chosen = spread_views(views, board, size.width, kStartViews);
  std::vector<std::vector<BoardCorner>> thinned;
  for (std::size_t i = 0; i < chosen.size() && i < kTableViews; ++i) thinned.push_back(thinned_corners(chosen[i].corners));
  if (thinned.empty()) return std::nullopt;
  std::vector<std::pair<double, Camera>> table;
  const Vec2 centre(0.5 * (size.width - 1), 0.5 * (size.height - 1));
  for (double focal_px = 0.2 * size.width; focal_px < 6.5 * size.width; focal_px *= 1.25)
    for (const LensModel& lens : shapes(model, focal_px, centre)) {
      const Camera camera(lens, size.width, size.height);
      table.push_back({unexplained_px(camera, board, thinned), camera});
    }
  std::ranges::stable_sort(table, {}, [](const auto& entry) { return entry.first; });
  std::optional<CameraStart> best;
  for (std::size_t i = 0; i < table.size() && i < kBestOfTable; ++i) {
    const auto candidate = adjusted(table[i].second, board, chosen);
    if (candidate && (!best || candidate->rms_px < best->rms_px)) best = candidate;
  }
  return best;
}

ModelChoice choose_model(const ImageSize& size, const Board& board, const std::vector<BoardView>& views) {
  const std::vector<BoardView> judged = spread_views(views, board, size.width, kJudgedViews);
  std::vector<std::vector<BoardView>> halves(2);
  for (std::size_t i = 0; i < judged.size(); ++i) halves[i % 2].push_back(judged[i]);
  ModelChoice choice;
  double best_px = kUnfit;
  for (const std::string& model : lens_names()) {
    choice.held_out_px.push_back({model, held_out_px(model, size, board, halves)});
    best_px = std::min(best_px, choice.held_out_px.back().second);
  }
  int fewest = kMostLensParameters + 1;
  double error_px = kUnfit;
  for (const auto& [model, px] : choice.held_out_px) {
    const int count = lens_parameter_count(*plain_lens(model, 1, {0, 0}));
    if (!(px <= 1.005 * best_px) || count > fewest || (count == fewest && px >= error_px)) continue;
    choice.model = model;
    fewest = count;
    error_px = px;
  }
  return choice;
}

}  // namespace fbvins
