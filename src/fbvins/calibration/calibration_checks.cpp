// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/calibration_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "fbvins/calibration/camera_start.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/calibration/refused.hpp"
#include "fbvins/calibration/target_file.hpp"

namespace fbvins {
namespace {

constexpr int kFewestViews = 6;
constexpr double kLeastBaseline_m = 1e-3;  ///< as every reader of calibrations demands it
/// Of the focal length near the axis; and where images contradict one another, which is said and in the standard deviations.
constexpr double kLargestFocalSigma = 5e-3, kLargestOfContradicting = 1e-2;
/// No corner of a printed board is better than this, whatever residuals say.
constexpr double kLeastCornerNoise_px = 0.03;
constexpr double kLargestCentreSigma = 5e-3;  ///< of the image's width
constexpr double kNoticedScatter = 1.5;

/// Relative deviation of the focal length near the axis, by corners that are not too good to be true: of ds and omni not the
/// parameter, but f / (1 + xi).
double axial_focal_sigma(const CameraCalibration& found, int camera) {
  const LensModel& lens = found.cameras[camera].camera.model();
  const auto first = std::ranges::find(found.names, fmt::format("cam{}.fx", camera)) - found.names.begin();
  const Eigen::RowVectorXd J = straight_jacobian(lens).row(0);
  const double square = J.dot(found.covariance.block(first, first, J.size(), J.size()) * J.transpose());
  return std::max(1.0, kLeastCornerNoise_px / found.noise_px) * std::sqrt(square) / straight_parameters(lens)[0];
}

std::string contradiction_of(const CameraCalibration& found) {
  return fmt::format(
      "the images contradict one another up to {:.1f} times as much as the noise of their corners explains, and standard deviations "
      "are as much larger: is the board flat, do the cameras expose at the same time, does the lens model fit?",
      found.scatter);
}

/// Another layout with which the views do make sense.
std::string better_board(const Board& board, const ImageSize& size, const std::vector<BoardView>& views, double best_px) {
  std::vector<std::pair<Board, std::string>> others;
  if (board.columns != board.rows) {
    Board turned = board;
    std::swap(turned.columns, turned.rows);
    others.push_back({turned, fmt::format("{} columns and {} rows", turned.columns, turned.rows)});
  }
  if (board.kind == BoardKind::aprilgrid)
    for (const double spacing : {0.1, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5}) {
      Board other = board;
      other.spacing = spacing;
      if (std::abs(spacing - board.spacing) > 1e-6) others.push_back({other, fmt::format("a tagSpacing of {:g}", spacing)});
    }
  std::string best;
  for (const auto& [other, words] : others) {
    const bool fits =
        std::ranges::all_of(views, [&](const BoardView& v) { return v.corners.back().index < other.corner_count(); });
    const auto start = fits ? start_camera("pinhole-equidistant", size, other, views) : std::nullopt;
    if (!start || start->rms_px >= best_px) continue;
    best = words;
    best_px = start->rms_px;
  }
  return best;
}

Error other_layout(int camera, const Board& board, const std::string& better) {
  return refused(fmt::format("the corners that cam{} sees do not lie as the target file says ({}): with {} they would", camera,
                             board.describe(), better));
}

Result<void> check_models(const CameraCalibrationOptions& options, int cameras) {
  const std::vector<std::string> names = lens_names();
  if (options.models.size() != 1 && static_cast<int>(options.models.size()) != cameras)
    return refused(fmt::format("{} lens models are given for {} cameras: give one for all, or one a camera",
                               options.models.size(), cameras));
  for (const std::string& model : options.models)
    if (model != kAutoModel && std::ranges::find(names, model) == names.end())
      return refused(fmt::format("'{}' is no lens model: {} or {}", model.substr(0, 40), fmt::join(names, ", "), kAutoModel));
  return {};
}

}  // namespace

bool enough_corners(const BoardView& view, const Board& board) {
  return static_cast<int>(view.corners.size()) >= (board.kind == BoardKind::aprilgrid ? 8 : 6);
}

ImageSize smallest_usual_size(const std::vector<BoardView>& views) {
  double right = 0, bottom = 0;
  for (const BoardView& view : views)
    for (const BoardCorner& corner : view.corners) {
      right = std::max(right, corner.pixel.x());
      bottom = std::max(bottom, corner.pixel.y());
    }
  for (const ImageSize size :
       {ImageSize{320, 240}, {640, 400},   {640, 480},   {512, 512},   {752, 480},   {848, 480},   {848, 800},   {800, 600},
        {1024, 768},         {1024, 1024}, {1280, 720},  {1280, 800},  {1280, 960},  {1280, 1024}, {1440, 1080}, {1600, 1200},
        {1920, 1080},        {1920, 1200}, {2048, 1536}, {2592, 1944}, {3840, 2160}, {4056, 3040}})
    if (right <= size.width - 1 && bottom <= size.height - 1) return size;
  return {static_cast<int>(std::ceil(right)) + 1, static_cast<int>(std::ceil(bottom)) + 1};
}

double largest_plausible_rms_px(const ImageSize& size) { return std::max(2.0, 2.5e-3 * size.width); }

Result<void> check_input(const Detections& detections, const Board& board, const CameraCalibrationOptions& options) {
  const int cameras = detections.camera_count();
  if (cameras == 0) return refused("the board was found in no image");
  if (Result<void> good = check_models(options, cameras); !good) return good.error();
  if (std::string problem = impossible(board); !problem.empty()) return refused(problem);
  std::vector<int> seen(cameras, 0), usable(cameras, 0);
  for (const BoardView& view : detections.views) {
    for (const BoardCorner& corner : view.corners)
      if (corner.index < 0 || corner.index >= board.corner_count())
        return refused(fmt::format("corner {} was found, but the target has {} corners ({}): the file describes another board",
                                   corner.index, board.corner_count(), board.describe()));
    ++seen[view.camera];
    usable[view.camera] += enough_corners(view, board);
    const auto size = detections.sizes.find(view.camera);
    if (size == detections.sizes.end()) continue;
    for (const BoardCorner& corner : view.corners)
      if (!(corner.pixel.x() >= -1 && corner.pixel.y() >= -1 && corner.pixel.x() <= size->second.width &&
            corner.pixel.y() <= size->second.height))
        return refused(
            fmt::format("cam{}: a corner at ({:.1f}, {:.1f}) lies outside of images of {} x {}: the size is another one",
                        view.camera, corner.pixel.x(), corner.pixel.y(), size->second.width, size->second.height));
  }
  for (int k = 0; k < cameras; ++k) {
    if (seen[k] == 0) return refused(fmt::format("cam{} never sees the board", k));
    if (usable[k] < kFewestViews)
      return refused(fmt::format("cam{} sees the board in {} images, too few: {} at least, 40 and more are better", k, usable[k],
                                 kFewestViews));
  }
  return {};
}

Error no_start(int camera, const Board& board, const ImageSize& size, const std::vector<BoardView>& views) {
  const std::string better = better_board(board, size, views, 0.3 * largest_plausible_rms_px(size));
  if (!better.empty()) return other_layout(camera, board, better);
  return refused(
      fmt::format("no lens of this model explains what cam{} sees: the target file describes another board than was "
                  "recorded ({}), or the lens needs another model (--model auto tries all)",
                  camera, board.describe()));
}

Result<bool> check_poses(const std::vector<PosedView>& posed, int cameras) {
  std::vector<int> usable(cameras, 0), mirrored(cameras, 0);
  for (const PosedView& view : posed) {
    ++usable[view.view.camera];
    mirrored[view.view.camera] += view.T_CnT.p.dot(view.T_CnT.q * Vec3::UnitZ()) > 0;
  }
  for (int k = 0; k < cameras; ++k) {
    if (usable[k] < kFewestViews)
      return refused(
          fmt::format("only {} images of cam{} fit the board and one lens, too few: {} at least; was the board bent or "
                      "another one?",
                      usable[k], k, kFewestViews));
    if (std::min(mirrored[k], usable[k] - mirrored[k]) > 0.2 * usable[k])
      return refused(
          fmt::format("cam{} sees the board mirrored in {} of {} images: two different boards were recorded, or images are "
                      "mirrored in part",
                      k, mirrored[k], usable[k]));
    if ((2 * mirrored[k] > usable[k]) != (2 * mirrored[0] > usable[0]))
      return refused(fmt::format("cam{} sees the board mirrored and cam{} does not: the images of one of them are mirrored",
                                 2 * mirrored[k] > usable[k] ? k : 0, 2 * mirrored[k] > usable[k] ? 0 : k));
  }
  return 2 * mirrored[0] > usable[0];
}

Result<void> check_fit(double noise_px, double single_px, const ImageSize& size, int cameras, const Board& board,
                       const std::vector<BoardView>& views) {
  constexpr double kPoor_px = 0.5;
  if (single_px > kPoor_px)
    if (const std::string better = better_board(board, size, views, 0.4 * single_px); !better.empty())
      return other_layout(0, board, better);
  if (cameras > 1 && noise_px > std::max(kPoor_px, 3 * single_px))
    return refused(
        fmt::format("each camera alone fits the board to {:.2f} px, but together they do not ({:.2f} px): images with the same "
                    "stamp were not taken at the same time, or the cameras moved against each other",
                    single_px, noise_px));
  if (!(noise_px < largest_plausible_rms_px(size)) || noise_px <= 0)
    return refused(
        fmt::format("the corners are {:.1f} px from where the calibration expects them: another board, another lens model "
                    "(--model auto), or a bent board",
                    noise_px));
  return {};
}

Error undetermined(const std::string& what) {
  return refused(
      fmt::format("{}: tilt the board or the camera by 30 degrees and more, to all sides, at several distances, and fill the "
                  "image's corners",
                  what));
}

Result<void> check_determined(const CameraCalibration& found) {
  const auto undetermined_by = [&](const std::string& what) {
    return found.scatter > kNoticedScatter ? refused(what + ": " + contradiction_of(found)) : undetermined(what);
  };
  for (std::size_t k = 0; k < found.cameras.size(); ++k) {
    const Camera& camera = found.cameras[k].camera;
    const double focal = axial_focal_sigma(found, static_cast<int>(k));
    if (!(focal <= (found.scatter > kNoticedScatter ? kLargestOfContradicting : kLargestFocalSigma)))
      return undetermined_by(
          fmt::format("the views do not determine the focal length of cam{} (to {:.1f} % only)", k, 100 * focal));
    const double centre_px = std::max(found.sigma(fmt::format("cam{}.cx", k)), found.sigma(fmt::format("cam{}.cy", k)));
    if (!(centre_px <= kLargestCentreSigma * camera.width()))
      return undetermined_by(
          fmt::format("the views do not determine the principal point of cam{} (to {:.1f} px only)", k, centre_px));
  }
  return {};
}

Result<void> check_places(const CameraCalibration& found) {
  for (std::size_t k = 1; k < found.cameras.size(); ++k)
    for (std::size_t j = 0; j < k; ++j) {
      const double apart_m = (found.cameras[k].T_CnC0 * found.cameras[j].T_CnC0.inverse().p).norm();
      if (apart_m < kLeastBaseline_m)
        return refused(fmt::format("cam{} and cam{} are in one place, to {:.2f} mm: these are the images of one camera twice", j,
                                   k, 1e3 * apart_m));
    }
  return {};
}

std::vector<std::string> remarks_on(const CameraCalibration& found) {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < found.cameras.size(); ++k) {
    const CalibratedCamera& c = found.cameras[k];
    if (c.size_guessed)
      out.push_back(fmt::format("the size of cam{}'s images is not in the detections: {} x {} is assumed (--resolution gives it)",
                                k, c.camera.width(), c.camera.height()));
    if (c.statistics.coverage < 0.6)
      out.push_back(fmt::format("corners cover {:.0f} % of cam{}'s image: hold the board into its corners, too",
                                100 * c.statistics.coverage, k));
  }
  if (found.scatter > kNoticedScatter) out.push_back(contradiction_of(found));
  if (found.seen_mirrored)
    out.emplace_back(
        "the board's x and y axes are left-handed in the images, unlike those of a board that `fbvins target` prints: "
        "lenses and extrinsics do not depend on how corners are counted, but with images that are mirrored nothing flies, "
        "and cameras alone cannot tell the two apart (an IMU can)");
  return out;
}

}  // namespace fbvins
