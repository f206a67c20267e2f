// SPDX-License-Identifier: Apache-2.0
// Where cameras sit on an IMU, and how their clocks differ: from views of a board and the IMU's readings meanwhile, by one
// least-squares fit of a continuous path (docs/derivations/calibration.md). No start values are needed. Pure function; the same
// input gives the same bytes.
//
//   Result<CameraImuResult> found = calibrate_imu_camera({board, cameras, {}, views, imu, noise}, {});
//   if (!found) report(found.error().message);      // one sentence: what the recording lacks
//   else use(found->cameras[0].T_BC, found->time_offset_s);
#pragma once

#include <string>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/board_view.hpp"
#include "fbvins/calibration/rig_variations.hpp"
#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

struct ImuCameraInput {
  Board board;
  std::vector<Camera> cameras;       ///< one to eight, by BoardView::camera; lenses are taken as they are
  std::vector<Pose<Cn, C0>> T_CnC0;  ///< one a camera (the first: identity), or none: found here
  std::vector<BoardView> views;      ///< in any order
  std::vector<ImuSample> imu;        ///< on the IMU's clock, in order
  ImuNoise noise;
  std::vector<RigVariation> variations = {};  ///< what cameras and T_CnC0 are uncertain by; none: they are exact
};

struct ImuCameraOptions {
  double max_time_offset_s = 5;
  /// How well given T_CnC0 are known. The default keeps them; larger: refined with the readings.
  double camera_sigma_m = 1e-6, camera_sigma_rad = 1e-6;
  bool imu_axes = false;    ///< estimate scale and axes of both triads
  bool line_delay = false;  ///< estimate the line delay of a rolling shutter, the same for all cameras
  bool camera_offsets =
      false;  ///< estimate a time offset of each camera; T_CnC0 are to be none then, or from images taken at once
  double gravity_mps2 = 9.81;
  double gravity_sigma_mps2 = 0.02;  ///< it differs by that much between places
};

struct CameraOnImu {
  Pose<B, Cn> T_BC;
  Mat6 covariance = Mat6::Zero();         ///< of (dp in B, dtheta in C): T_BC.boxplus
  double later_s = 0, later_sigma_s = 0;  ///< t_imu = t_image + time_offset_s + later_s; none of camera 0
  int views = 0, corners = 0, outliers = 0;
  double rms_px = 0;  ///< of one coordinate, without outliers
};

/// A reading is gyro * w + bias, accel * f + bias; `accel` is lower triangular, which defines the axes of B.
struct ImuTriads {
  Mat3 gyro = Mat3::Identity(), accel = Mat3::Identity();
};

struct BiasAt {
  Time t;  ///< IMU's clock
  ImuBias bias, sigma;
};

/// The fit at one view or reading, for the page.
struct ViewFit {
  Time t;
  int camera = 0;
  double rms_px = 0;
  double noise_factor = 1;           ///< above 1: blurred, its corners count less
  std::vector<int> corners;          ///< Board::corner
  std::vector<Vec2> pixels, errors;  ///< seen; predicted minus seen, px
};
struct ReadingFit {
  Time t;
  Vec3 gyro_sigmas, accel_sigmas;
  bool used = true;
};

/// Name, value and standard deviation of every calibrated parameter, in the order of `covariance`.
struct CalibratedParameter {
  std::string name, unit;
  double value = 0, sigma = 0;
};

struct CameraImuResult {
  std::vector<CameraOnImu> cameras;
  double time_offset_s = 0, time_offset_sigma_s = 0;  ///< t_imu = t_image + time_offset_s
  /// Row v is exposed at t_image + time_offset_s + (v - height / 2) * line_delay_s (U4).
  double line_delay_s = 0, line_delay_sigma_s = 0;
  Vec3 gravity_T = Vec3::Zero();  ///< in the board's frame, m/s^2
  Mat3 gravity_covariance = Mat3::Zero();
  ImuTriads axes, axes_sigma;
  std::vector<BiasAt> biases;

  /// Estimated first, without prior knowledge, since they reveal a wrong board or unit: gravity by the accelerometer, and the
  /// true size of the board over that in the file.
  double measured_gravity_mps2 = 0, measured_gravity_sigma_mps2 = 0;
  double board_scale = 1, board_scale_sigma = 0;

  std::vector<std::string> remarks;  ///< sentences for the user
  double stamp_jitter_s = 0;         ///< standard deviation of the images' stamps; 0: not seen
  double image_factor = 1;           ///< what moves all corners of an image together, over what each corner's noise explains
  double corner_sigma_px = 0;        ///< of one coordinate, from the residuals and the degrees of freedom
  /// Root mean square of residuals over the noise given, degrees of freedom regarded: 1 where the noise is right. Above 1, the
  /// covariances are those of the larger noise.
  double gyro_rms_sigmas = 0, accel_rms_sigmas = 0;
  int readings = 0, readings_refused = 0;
  double knot_spacing_s = 0, duration_s = 0;
  int iterations = 0;

  std::vector<CalibratedParameter> parameters;
  Eigen::MatrixXd covariance;  ///< of `parameters`
  std::vector<ViewFit> view_fits;
  std::vector<ReadingFit> reading_fits;
  /// With a line delay: the views as they would be, had all rows been exposed with the middle one; corners that the fit uses.
  std::vector<BoardView> global_views;
};

/// An error, one sentence, where the recording does not determine what is asked for or contradicts itself.
Result<CameraImuResult> calibrate_imu_camera(const ImuCameraInput& input, const ImuCameraOptions& options);

}  // namespace fbvins
