// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/camera_start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fbvins/calibration/board_pose.hpp"
#include "fbvins/calibration/corner_noise.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/calibration/rig_adjustment.hpp"
#include "fbvins/calibration/view_choice.hpp"

namespace fbvins {
namespace {

constexpr int kStartViews = 24, kTableViews = 8, kTableCorners = 24, kStartCorners = 72, kBestOfTable = 3, kJudgedViews = 120,
              kDecisiveViews = 150;
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

std::vector<BoardCorner> thinned_corners(const std::vector<BoardCorner>& corners, std::size_t most) {
  std::vector<BoardCorner> out;
  const std::size_t step = (corners.size() + most - 1) / most;
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
    RigFrame frame{view.t, {{0, {}}}, {posed->T_CnT.q, posed->T_CnT.p}};
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
    for (const SeenCorner& corner : frame.views[0].corners)
      sizes.push_back(adjustment.residual(frame, frame.views[0], corner).norm());
  return sizes.empty() ? kUnfit : coordinate_noise(sizes);
}

struct Adjusted {
  CameraStart start;
  double cost = 0;
};

/// Adjusted to the views, with their poses as the given lens has them.
std::optional<Adjusted> adjusted(const Camera& camera, const Board& board, const std::vector<BoardView>& views,
                                 double spread_px) {
  std::vector<RigFrame> frames = posed_frames(camera, board, views);
  if (2 * frames.size() < views.size() || frames.size() < 3) return std::nullopt;
  RigAdjustment adjustment({{camera.model(), {}}}, std::move(frames));
  const AdjustmentSummary summary = adjustment.solve({.spread_px = spread_px, .max_iterations = 40});
  if (!summary.usable) return std::nullopt;
  return Adjusted{{Camera(adjustment.cameras()[0].lens, camera.width(), camera.height()), robust_rms(adjustment)}, summary.cost};
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
    const auto lens = start ? adjusted(start->camera, board, halves[fitted], 1) : std::nullopt;
    const double error_px = lens ? predicted_px(lens->start.camera, board, halves[1 - fitted]) : kUnfit;
    square += 0.5 * error_px * error_px;
  }
  return std::sqrt(square);
}

/// The lenses of the table that leave least unexplained: of a model with several shapes the best of each shape.
std::vector<Camera> best_of_table(const std::string& model, const ImageSize& size, const Board& board,
                                  const std::vector<std::vector<BoardCorner>>& views) {
  struct Entry {
    double unexplained_px = 0;
    std::size_t shape = 0;
    Camera camera;
  };
  std::vector<Entry> table;
  const Vec2 centre(0.5 * (size.width - 1), 0.5 * (size.height - 1));
  std::size_t shape_count = 1;
  for (double focal_px = 0.2 * size.width; focal_px < 6.5 * size.width; focal_px *= 1.3) {
    const std::vector<LensModel> lenses = shapes(model, focal_px, centre);
    shape_count = lenses.size();
    for (std::size_t i = 0; i < lenses.size(); ++i) {
      const Camera camera(lenses[i], size.width, size.height);
      table.push_back({unexplained_px(camera, board, views), i, camera});
    }
  }
  std::ranges::stable_sort(table, {}, &Entry::unexplained_px);
  std::vector<Camera> out;
  for (std::size_t shape = 0; shape < shape_count; ++shape) {
    std::size_t taken = 0;
    for (const Entry& entry : table)
      if (entry.shape == shape && taken++ < kBestOfTable / shape_count) out.push_back(entry.camera);
  }
  return out;
}

/// The double sphere often has a second solution with another xi, which few views cannot distinguish from the first.
std::vector<Adjusted> distinct_rivals(const std::vector<Adjusted>& fitted) {
  std::vector<Adjusted> out = {fitted[0]};
  for (const Adjusted& other : fitted) {
    const auto* lens = std::get_if<DoubleSphere>(&other.start.camera.model());
    if (!lens || other.start.rms_px > 1.1 * fitted[0].start.rms_px + 0.02) continue;
    if (std::ranges::all_of(
            out, [&](const Adjusted& a) { return std::abs(std::get<DoubleSphere>(a.start.camera.model()).xi - lens->xi) > 0.1; }))
      out.push_back(other);
  }
  return out;
}

/// The rival that explains many views best.
CameraStart decided(const std::vector<Adjusted>& rivals, const Board& board, const std::vector<BoardView>& views) {
  std::optional<Adjusted> best;
  for (const Adjusted& rival : rivals) {
    const auto candidate = adjusted(rival.start.camera, board, views, 1);
    if (candidate && (!best || candidate->cost < best->cost)) best = candidate;
  }
  return best ? best->start : rivals[0].start;
}

}  // namespace

std::optional<CameraStart> start_camera(const std::string& model, const ImageSize& size, const Board& board,
                                        const std::vector<BoardView>& views) {
  std::vector<BoardView> chosen = spread_views(views, board, size.width, kStartViews);
  if (chosen.empty()) return std::nullopt;
  std::vector<std::vector<BoardCorner>> thinned;
  for (std::size_t i = 0; i < chosen.size() && i < kTableViews; ++i)
    thinned.push_back(thinned_corners(chosen[i].corners, kTableCorners));
  for (BoardView& view : chosen) view.corners = thinned_corners(view.corners, kStartCorners);
  std::vector<Adjusted> fitted;
  for (const Camera& camera : best_of_table(model, size, board, thinned))
    if (const auto candidate = adjusted(camera, board, chosen, 4)) fitted.push_back(*candidate);
  if (fitted.empty()) return std::nullopt;
  std::ranges::stable_sort(fitted, {}, [](const Adjusted& a) { return a.start.rms_px; });
  const std::vector<Adjusted> rivals = distinct_rivals(fitted);
  if (rivals.size() > 1) return decided(rivals, board, spread_views(views, board, size.width, kDecisiveViews));
  // Poses found anew with the better lens: some were the wrong one of two, or did not fit at all.
  const auto again = adjusted(rivals[0].start.camera, board, chosen, 1);
  return again && again->start.rms_px <= rivals[0].start.rms_px ? again->start : rivals[0].start;
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
