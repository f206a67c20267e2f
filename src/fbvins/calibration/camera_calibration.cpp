// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/camera_calibration.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "fbvins/calibration/calibration_checks.hpp"
#include "fbvins/calibration/camera_chain.hpp"
#include "fbvins/calibration/camera_start.hpp"
#include "fbvins/calibration/frame_scatter.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/calibration/outliers.hpp"
#include "fbvins/calibration/view_choice.hpp"

namespace fbvins {
namespace {

constexpr int kQuickStamps = 60;       ///< of the adjustment before views are chosen
constexpr int kMostCandidates = 1000;  ///< stamps among which is chosen

/// One camera's part of the input.
struct OneCamera {
  ImageSize size;
  bool size_guessed = false;
  std::vector<BoardView> views;
  std::vector<std::pair<std::string, double>> held_out_px;
  CameraStart start;
};

std::vector<OneCamera> by_camera(const Detections& detections, const Board& board) {
  std::vector<OneCamera> out(detections.camera_count());
  for (const BoardView& view : detections.views)
    if (enough_corners(view, board)) out[view.camera].views.push_back(view);
  for (std::size_t k = 0; k < out.size(); ++k) {
    const auto known = detections.sizes.find(static_cast<int>(k));
    out[k].size_guessed = known == detections.sizes.end();
    out[k].size = out[k].size_guessed ? smallest_usual_size(out[k].views) : known->second;
  }
  return out;
}

Result<void> start(OneCamera& camera, int index, const std::string& model, const Board& board) {
  std::string chosen = model;
  if (model == kAutoModel) {
    ModelChoice choice = choose_model(camera.size, board, camera.views);
    if (choice.model.empty()) return no_start(index, board, camera.size, camera.views);
    chosen = choice.model;
    camera.held_out_px = std::move(choice.held_out_px);
  }
  const auto found = start_camera(chosen, camera.size, board, camera.views);
  if (!found || found->rms_px > largest_plausible_rms_px(camera.size)) return no_start(index, board, camera.size, camera.views);
  camera.start = *found;
  return {};
}

/// Every view with the board's pose; views that do not fit are left out.
std::vector<PosedView> posed_views(const std::vector<OneCamera>& cameras, const Board& board) {
  std::vector<PosedView> out;
  for (const OneCamera& camera : cameras)
    for (const BoardView& view : camera.views) {
      const auto posed = find_board_pose(camera.start.camera, board, view.corners);
      if (posed && posed->rms_px < std::max(1.0, 5 * camera.start.rms_px)) out.push_back({view, posed->T_CnT});
    }
  return out;
}

/// Every n-th, so that at most `most` remain.
std::vector<RigFrame> thinned(const std::vector<RigFrame>& frames, int most) {
  std::vector<RigFrame> out;
  const double step = std::max(1.0, static_cast<double>(frames.size()) / most);
  for (double i = 0; i < static_cast<double>(frames.size()) - 0.5; i += step) out.push_back(frames[static_cast<std::size_t>(i)]);
  return out;
}

/// The frames to adjust: all, or those with most information about lenses and extrinsics, by a quick adjustment.
std::vector<RigFrame> chosen_frames(std::vector<RigCamera>& cameras, std::vector<RigFrame> frames, int most) {
  RigAdjustment quick(cameras, thinned(frames, kQuickStamps));
  quick.solve({.spread_px = 1, .max_iterations = 30});
  cameras = quick.cameras();
  if (static_cast<int>(frames.size()) <= most) return frames;
  std::vector<RigFrame> candidates = thinned(frames, std::max(most, kMostCandidates));
  std::vector<Eigen::MatrixXd> information;
  for (const RigFrame& frame : candidates) information.push_back(quick.evidence(frame).information);
  std::vector<RigFrame> out;
  for (const int i : most_informative(information, most)) out.push_back(std::move(candidates[i]));
  return out;
}

/// The covariance of the cameras' parameters for a noise of 1 px; nullopt where a combination is not determined at all.
std::optional<Eigen::MatrixXd> unit_covariance(const std::vector<RigAdjustment::Evidence>& frames, int size) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
  for (const RigAdjustment::Evidence& frame : frames) sum += frame.information;
  const Eigen::VectorXd scale = sum.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * sum * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  if (!(eigen.eigenvalues()[0] > 1e-13)) return std::nullopt;
  const Eigen::MatrixXd inverse =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  return Eigen::MatrixXd(scale.asDiagonal() * inverse * scale.asDiagonal());
}

std::vector<std::string> parameter_names(const std::vector<RigCamera>& cameras) {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    for (const std::string& name : lens_parameter_names(cameras[k].lens)) out.push_back(fmt::format("cam{}.{}", k, name));
    for (const char* name : {"px", "py", "pz", "rx", "ry", "rz"})
      if (k > 0) out.push_back(fmt::format("cam{}.{}", k, name));
  }
  return out;
}

void add_residuals(const RigAdjustment& adjustment, CameraCalibration& out) {
  std::vector<double> squares(out.cameras.size(), 0);
  std::vector<std::vector<bool>> cells(out.cameras.size(), std::vector<bool>(64, false));
  for (const RigFrame& frame : adjustment.frames()) {
    out.poses.push_back({frame.t, frame.T_C0T});
    for (const SeenBoard& view : frame.views) {
      CalibratedCamera& camera = out.cameras[view.camera];
      ReprojectionStatistics& s = camera.statistics;
      ++s.views;
      for (const SeenCorner& corner : view.corners) {
        if (!corner.kept) {
          ++s.left_out;
          continue;
        }
        const Vec2 r = adjustment.residual(frame, view, corner);
        out.residuals.push_back({frame.t, view.camera, corner.index, corner.pixel, r});
        ++s.corners;
        squares[view.camera] += r.squaredNorm();
        s.largest_px = std::max(s.largest_px, r.norm());
        const int column = std::clamp(static_cast<int>(8 * corner.pixel.x() / camera.camera.width()), 0, 7);
        const int row = std::clamp(static_cast<int>(8 * corner.pixel.y() / camera.camera.height()), 0, 7);
        cells[view.camera][8 * row + column] = true;
      }
    }
  }
  for (std::size_t k = 0; k < out.cameras.size(); ++k) {
    ReprojectionStatistics& s = out.cameras[k].statistics;
    s.rms_px = std::sqrt(squares[k] / std::max(1, 2 * s.corners));
    s.coverage = static_cast<double>(std::ranges::count(cells[k], true)) / 64;
  }
}

CameraCalibration result_of(const RigAdjustment& adjustment, const std::vector<OneCamera>& cameras, double noise_px) {
  CameraCalibration out;
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    const RigCamera& found = adjustment.cameras()[k];
    CalibratedCamera camera;
    camera.camera = Camera(found.lens, cameras[k].size.width, cameras[k].size.height);
    camera.T_CnC0 = found.T_CnC0;
    camera.held_out_px = cameras[k].held_out_px;
    camera.size_guessed = cameras[k].size_guessed;
    out.cameras.push_back(std::move(camera));
  }
  out.names = parameter_names(adjustment.cameras());
  out.noise_px = noise_px;
  add_residuals(adjustment, out);
  return out;
}

}  // namespace

double CameraCalibration::sigma(const std::string& name) const {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return 0;
  return std::sqrt(std::max(0.0, covariance(found - names.begin(), found - names.begin())));
}

Result<CameraCalibration> calibrate_cameras(const Detections& detections, const Board& board,
                                            const CameraCalibrationOptions& options) {
  const auto report = [&](const std::string& what) {
    if (options.on_progress) options.on_progress(what);
  };
  if (Result<void> good = check_input(detections, board, options); !good) return good.error();
  std::vector<OneCamera> cameras = by_camera(detections, board);
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    report(fmt::format("cam{}: start values from {} views", k, cameras[k].views.size()));
    const std::string& model = options.models[options.models.size() == 1 ? 0 : k];
    if (Result<void> good = start(cameras[k], static_cast<int>(k), model, board); !good) return good.error();
  }
  const std::vector<PosedView> posed = posed_views(cameras, board);
  const Result<bool> mirrored = check_poses(posed, static_cast<int>(cameras.size()));
  if (!mirrored) return mirrored.error();
  const auto stamps = joined_by_stamp(posed, options.pair_tolerance_s);
  const auto T_CnC0 = chain_cameras(stamps, static_cast<int>(cameras.size()));
  if (!T_CnC0) return T_CnC0.error();

  std::vector<RigCamera> rig;
  double single_px = 0;
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    rig.push_back({cameras[k].start.camera.model(), (*T_CnC0)[k]});
    single_px = std::max(single_px, cameras[k].start.rms_px);
  }
  std::vector<RigFrame> frames = chosen_frames(rig, rig_frames(stamps, *T_CnC0, board), options.max_views);
  report(fmt::format("adjusting {} of {} stamps", frames.size(), stamps.size()));
  RigAdjustment adjustment(std::move(rig), std::move(frames));
  const double noise_px = adjust_without_outliers(adjustment);
  if (Result<void> good =
          check_fit(noise_px, single_px, cameras[0].size, static_cast<int>(cameras.size()), board, cameras[0].views);
      !good)
    return good.error();
  const std::vector<RigAdjustment::Evidence> evidence = adjustment.evidence();
  const auto unit = unit_covariance(evidence, adjustment.parameter_count());
  if (!unit) return undetermined("the views do not determine all parameters");
  CameraCalibration out = result_of(adjustment, cameras, noise_px);
  out.covariance = covariance_by_scatter(evidence, *unit, noise_px);
  out.scatter = std::sqrt(out.covariance.diagonal().cwiseQuotient(unit->diagonal()).maxCoeff()) / noise_px;
  out.stamps = static_cast<int>(stamps.size());
  out.seen_mirrored = *mirrored;
  if (Result<void> good = check_determined(out); !good) return good.error();
  if (Result<void> good = check_places(out); !good) return good.error();
  out.remarks = remarks_on(out);
  return out;
}

}  // namespace fbvins
