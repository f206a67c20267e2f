// SPDX-License-Identifier: Apache-2.0
// Lenses and extrinsics of one to eight cameras from their views of a board, without a guess from the user. Frames: C0 is
// cam0, Cn the camera at hand, T the board. Pure functions, any thread; the same input gives the same bytes.
//
//   Result<CameraCalibration> found = calibrate_cameras(detections, board, {.models = {"pinhole-radtan"}});
//   found->cameras[1].T_CnC0;                 // of cam1
//   found->sigma("cam0.fx");                  // px
//
// Method: each camera alone from homographies, over a table of focal lengths and shapes; extrinsics from common views; then
// one adjustment of all lenses, extrinsics and board poses, in which views are chosen by the information that they add, corners
// that do not fit are left out, and the covariance comes from the normal equations without the board's poses.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/detections_file.hpp"
#include "fbvins/camera/camera.hpp"

namespace fbvins {

inline constexpr const char* kAutoModel = "auto";

struct CameraCalibrationOptions {
  /// One for all cameras, or one a camera: as Camera::model_name() names them, or "auto": the model that predicts views best
  /// which it was not fitted to.
  std::vector<std::string> models = {"pinhole-radtan"};
  int max_views = 600;                                       ///< stamps that enter the adjustment
  double pair_tolerance_s = 1e-3;                            ///< images of two cameras with stamps that close are one view
  std::function<void(const std::string&)> on_progress = {};  ///< progress, a few words
};

/// Residuals of one camera, px; of a coordinate, not of a distance.
struct ReprojectionStatistics {
  int views = 0, corners = 0;
  int left_out = 0;       ///< corners that did not fit
  double rms_px = 0;      ///< root mean square of the residuals
  double largest_px = 0;  ///< distance
  double coverage = 0;    ///< part of the image's 8 x 8 cells that hold corners
};

struct CalibratedCamera {
  Camera camera;
  Pose<Cn, C0> T_CnC0;
  ReprojectionStatistics statistics;
  /// Held-out reprojection error of each model that was tried, px; empty unless asked for ("auto").
  std::vector<std::pair<std::string, double>> held_out_px;
  bool size_guessed = false;  ///< the images' size was not known: the smallest usual one that holds all corners
};

/// The board in one stamp's cam0 frame, whether or not cam0 sees it.
struct BoardPose {
  Time t;
  Pose<C0, T> T_C0T;
};

struct CornerResidual {
  Time t;
  int camera = 0, corner = 0;
  Vec2 pixel;        ///< as detected
  Vec2 residual_px;  ///< detected minus predicted
};

struct CameraCalibration {
  std::vector<CalibratedCamera> cameras;
  /// Rows of the covariance: "cam0.fx" ..., then for cam1 and on "cam1.px" "cam1.py" "cam1.pz" (T_CnC0's translation, m, in
  /// Cn) and "cam1.rx" ... (rad, R_CnC0 <- R Exp(r)).
  std::vector<std::string> names;
  Eigen::MatrixXd covariance;
  double noise_px = 0;  ///< standard deviation of a corner's coordinate, as the residuals show it
  /// Largest factor of the standard deviations for what moves all corners of an image together (frame_scatter.hpp); 1: nothing
  /// seen.
  double scatter = 1;
  std::vector<BoardPose> poses;  ///< of the stamps used, by time
  std::vector<CornerResidual> residuals;
  int stamps = 0;                    ///< with a usable view; poses.size() of them were used
  bool seen_mirrored = false;        ///< x and y of the board are left-handed in the images, unlike those of Kalibr's print
  std::vector<std::string> remarks;  ///< sentences for the user

  double sigma(const std::string& name) const;  ///< 0 for an unknown name
};

Result<CameraCalibration> calibrate_cameras(const Detections& detections, const Board& board,
                                            const CameraCalibrationOptions& options);

/// Whether boards that two cameras see at one stamp join all cameras with cam0; calibrate_cameras() refuses others.
bool cameras_connected(const Detections& detections, const Board& board, double pair_tolerance_s);

/// Each camera by itself, where they are not connected: T_CnC0 are the identity and have no rows in the covariance, until an IMU
/// joins the cameras (calibrate_imu_camera() without T_CnC0). `poses` are those of cam0.
Result<CameraCalibration> calibrate_cameras_apart(const Detections& detections, const Board& board,
                                                  const CameraCalibrationOptions& options);

}  // namespace fbvins
