// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/rig_knowledge.hpp"

#include <Eigen/Dense>
#include <algorithm>

#include "fbvins/calibration/calibration_checks.hpp"
#include "fbvins/calibration/camera_chain.hpp"
#include "fbvins/calibration/camera_start.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/calibration/view_choice.hpp"

namespace fbvins {
namespace {

constexpr double kUsualFocal = 0.6, kShortestFocal = 0.15, kLongestFocal = 3;  // of the image's width
constexpr int kMostViews = 40;                                                 // of a camera, for rough knowledge
constexpr std::size_t kFewestForStart = 3;

std::vector<std::vector<bool>> no_cells(const std::vector<Camera>& cameras) {
  std::vector<std::vector<bool>> out;
  for (const Camera& camera : cameras) out.emplace_back(static_cast<std::size_t>(ImageCells::of(camera).count()), false);
  return out;
}

void mark(RigKnowledge& knowledge, int camera, const Vec2& pixel) {
  const auto k = static_cast<std::size_t>(camera);
  knowledge.used[k][static_cast<std::size_t>(ImageCells::of(knowledge.cameras[k]).cell_of(pixel))] = true;
}

Camera rough_camera(const std::string& model, const ImageSize& size, const Board& board, const std::vector<BoardView>& views) {
  const std::string name = model == kAutoModel ? "pinhole-radtan" : model;
  if (views.size() >= kFewestForStart)
    if (const auto start = start_camera(name, size, board, views); start && start->rms_px < largest_plausible_rms_px(size) &&
                                                                   start->camera.focal_px() > kShortestFocal * size.width &&
                                                                   start->camera.focal_px() < kLongestFocal * size.width)
      return start->camera;
  const Vec2 centre(0.5 * (size.width - 1), 0.5 * (size.height - 1));
  return {*plain_lens(name, kUsualFocal * size.width, centre), size.width, size.height};
}

/// With cameras that are not joined yet at cam0's place.
std::vector<Pose<Cn, C0>> rough_places(const std::vector<std::vector<PosedView>>& stamps, std::vector<bool>& joined) {
  const int cameras = static_cast<int>(joined.size());
  if (const auto all = chain_cameras(stamps, cameras)) {
    joined.assign(joined.size(), true);
    return *all;
  }
  return std::vector<Pose<Cn, C0>>(joined.size());
}

}  // namespace

std::vector<RigCamera> RigKnowledge::rig() const {
  std::vector<RigCamera> out;
  for (std::size_t k = 0; k < cameras.size(); ++k) out.push_back({cameras[k].model(), T_CnC0[k]});
  return out;
}

RigKnowledge knowledge_of(const CameraCalibration& found) {
  RigKnowledge out;
  for (const CalibratedCamera& camera : found.cameras) {
    out.cameras.push_back(camera.camera);
    out.T_CnC0.push_back(camera.T_CnC0);
  }
  out.noise_px = found.noise_px;
  const Eigen::VectorXd scale = found.covariance.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * found.covariance * scale.asDiagonal();
  const Eigen::MatrixXd inverse = scaled.ldlt().solve(Eigen::MatrixXd::Identity(scaled.rows(), scaled.cols()));
  const Eigen::MatrixXd information = found.noise_px * found.noise_px * (scale.asDiagonal() * inverse * scale.asDiagonal());
  const RigAdjustment adjustment(out.rig(), {});
  const auto size = adjustment.parameter_count();
  out.joined.assign(out.cameras.size(), information.rows() == size);
  out.information = Eigen::MatrixXd::Zero(size, size);
  std::vector<int> columns;  // of cameras that are not joined the lenses alone are in the covariance
  for (int k = 0; k < static_cast<int>(out.cameras.size()); ++k) {
    const bool moves = k > 0 && information.rows() == size;
    const int count = lens_parameter_count(out.cameras[static_cast<std::size_t>(k)].model()) + (moves ? 6 : 0);
    for (int i = 0; i < count; ++i) columns.push_back(adjustment.first_of(k) + i);
  }
  for (std::size_t i = 0; i < columns.size(); ++i)
    for (std::size_t j = 0; j < columns.size(); ++j)
      out.information(columns[i], columns[j]) = information(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  out.used = no_cells(out.cameras);
  for (const CornerResidual& corner : found.residuals) mark(out, corner.camera, corner.pixel);
  return out;
}

RigKnowledge rough_knowledge(const Detections& detections, const Board& board, const std::vector<std::string>& models,
                             double pair_tolerance_s) {
  RigKnowledge out;
  const auto count = static_cast<std::size_t>(detections.camera_count());
  std::vector<PosedView> posed;
  for (std::size_t k = 0; k < count; ++k) {
    std::vector<BoardView> views;
    for (const BoardView& view : detections.views)
      if (view.camera == static_cast<int>(k) && enough_corners(view, board)) views.push_back(view);
    const auto known = detections.sizes.find(static_cast<int>(k));
    const ImageSize size = known != detections.sizes.end() ? known->second : smallest_usual_size(views);
    out.cameras.push_back(rough_camera(models[models.size() == 1 ? 0 : k], size, board, views));
    for (const BoardView& view : spread_views(views, board, size.width, kMostViews))
      if (const auto pose = find_board_pose(out.cameras[k], board, view.corners)) posed.push_back({view, pose->T_CnT});
  }
  out.used = no_cells(out.cameras);
  out.joined.assign(count, count < 2);
  const auto stamps = joined_by_stamp(posed, pair_tolerance_s);
  out.T_CnC0 = rough_places(stamps, out.joined);
  const bool joined = std::ranges::all_of(out.joined, [](bool one) { return one; });
  RigAdjustment adjustment(out.rig(), {});
  out.information = Eigen::MatrixXd::Zero(adjustment.parameter_count(), adjustment.parameter_count());
  // Cameras that are not joined tell of themselves only.
  const auto frames = rig_frames(joined ? stamps : joined_by_stamp(posed, -1), out.T_CnC0, board);
  for (const RigFrame& frame : frames) out.information += adjustment.evidence(frame).information;
  for (const PosedView& one : posed)
    for (const BoardCorner& corner : one.view.corners) mark(out, one.view.camera, corner.pixel);
  return out;
}

}  // namespace fbvins
