// SPDX-License-Identifier: Apache-2.0
// Cameras that never see the board together.

#include <algorithm>
#include <numeric>

#include "fbvins/calibration/calibration_checks.hpp"
#include "fbvins/calibration/camera_calibration.hpp"
#include "fbvins/calibration/camera_chain.hpp"

namespace fbvins {
namespace {

/// A sentence about the only camera, which was called cam0, with its own name.
std::string renamed(std::string text, int camera) {
  for (std::size_t at = text.find("cam0"); at != std::string::npos; at = text.find("cam0", at + 4))
    text[at + 3] = static_cast<char>('0' + camera);
  return text;
}

Detections only(const Detections& all, int camera) {
  Detections out;
  for (const BoardView& view : all.views)
    if (view.camera == camera) out.views.push_back({view.t, 0, view.corners});
  if (const auto size = all.sizes.find(camera); size != all.sizes.end()) out.sizes[0] = size->second;
  return out;
}

/// Appends one camera's result, found as cam0.
void append(CameraCalibration&& one, int camera, CameraCalibration& out) {
  const Eigen::Index before = out.covariance.rows(), more = one.covariance.rows();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(before + more, before + more);
  covariance.topLeftCorner(before, before) = out.covariance;
  covariance.bottomRightCorner(more, more) = one.covariance;
  out.covariance = std::move(covariance);
  for (const std::string& name : one.names) out.names.push_back(renamed(name, camera));
  for (const std::string& remark : one.remarks) out.remarks.push_back(renamed(remark, camera));
  for (CornerResidual& residual : one.residuals) {
    residual.camera = camera;
    out.residuals.push_back(residual);
  }
  out.cameras.push_back(std::move(one.cameras[0]));
  out.noise_px = std::max(out.noise_px, one.noise_px);
  out.scatter = std::max(out.scatter, one.scatter);
  out.stamps += one.stamps;
  out.seen_mirrored = out.seen_mirrored || one.seen_mirrored;
  if (camera == 0) out.poses = std::move(one.poses);
}

}  // namespace

bool cameras_connected(const Detections& detections, const Board& board, double pair_tolerance_s) {
  std::vector<PosedView> views;
  for (const BoardView& view : detections.views)
    if (enough_corners(view, board)) views.push_back({{view.t, view.camera, {}}, {}});
  std::vector<int> group(static_cast<std::size_t>(detections.camera_count()));
  std::iota(group.begin(), group.end(), 0);
  for (const auto& stamp : joined_by_stamp(std::move(views), pair_tolerance_s))
    for (const PosedView& view : stamp) {
      const int from = group[view.view.camera], to = group[stamp.front().view.camera];
      std::ranges::replace(group, from, to);
    }
  return std::ranges::all_of(group, [&](int g) { return g == group[0]; });
}

Result<CameraCalibration> calibrate_cameras_apart(const Detections& detections, const Board& board,
                                                  const CameraCalibrationOptions& options) {
  CameraCalibration out;
  const int cameras = detections.camera_count();
  if (Result<void> good = check_input(detections, board, options); !good) return good.error();
  for (int k = 0; k < cameras; ++k) {
    CameraCalibrationOptions own = options;
    own.models = {options.models[options.models.size() == 1 ? 0 : k]};
    own.on_progress = [&](const std::string& what) {
      if (options.on_progress) options.on_progress(renamed(what, k));
    };
    Result<CameraCalibration> one = calibrate_cameras(only(detections, k), board, own);
    if (!one) return Error{one.error().code, renamed(one.error().message, k)};
    append(*std::move(one), k, out);
  }
  return out;
}

}  // namespace fbvins
