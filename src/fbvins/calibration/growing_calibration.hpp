// SPDX-License-Identifier: Apache-2.0
// A calibration while its views still come: how far each part is from its aim, and what to do next. One thread. It only judges:
// the calibration that is kept is made of everything at the end (calibrate_cameras(), calibrate_imu_camera()).
//
//   GrowingCalibration growing(board, {.cameras = {.models = {"ds"}}, .with_imu = true});
//   const CalibrationProgress progress = growing.judge({detections, readings, newest_views});
//   if (!progress.reached) print(progress.action);
#pragma once

#include <string>
#include <vector>

#include "fbvins/calibration/camera_calibration.hpp"
#include "fbvins/calibration/imu_camera.hpp"
#include "fbvins/calibration/next_view.hpp"
#include "fbvins/calibration/residual_summary.hpp"
#include "fbvins/calibration/rig_knowledge.hpp"
#include "fbvins/calibration/weak_parts.hpp"

namespace fbvins {

struct GrowingOptions {
  CameraCalibrationOptions cameras = {};  ///< max_views is chosen here
  ImuCameraOptions imu = {};
  bool with_imu = false;
  ImuNoise imu_noise = {};
  CertaintyAims aims = {};
  double patience_s = 1.5;  ///< the views that are looked at are as many as the cameras' adjustment can use in about this time
};

/// All that was recorded so far.
struct GrowingInput {
  const Detections& detections;
  const std::vector<ImuSample>& imu;
  const std::vector<BoardView>& now;  ///< the newest view of each camera that sees the board at this moment
};

/// Corners in the cells of a camera's image.
struct ImageCoverage {
  ImageSize size;
  ImageCells grid;
  std::vector<int> corners;  ///< of each cell
  int views = 0;
};

struct CalibrationProgress {
  std::vector<ImageCoverage> cameras;
  std::vector<WeakPart> parts;  ///< determined or not; without those of the IMU until the cameras are known
  std::string action;           ///< what to do next, a sentence without its full stop
  std::string reason;           ///< what that is for
  double noise_px = 0;          ///< of a corner; 0: there is no calibration of the cameras yet
  bool cameras_reached = false, reached = false;
};

class GrowingCalibration {
 public:
  GrowingCalibration(const Board& board, GrowingOptions options) : board_(board), options_(std::move(options)) {}

  CalibrationProgress judge(const GrowingInput& input);

 private:
  std::vector<std::string> models_for(std::size_t views);
  void judge_imu(const GrowingInput& input, const CameraCalibration& cameras, CalibrationProgress& progress);
  void guide(const GrowingInput& input, const RigKnowledge& known, CalibrationProgress& progress);

  Board board_;
  GrowingOptions options_;
  int most_stamps_ = 60;             ///< in the next adjustment of the cameras
  NextView asked_;                   ///< what the hand was asked for last
  int asked_for_ = 0;                ///< judgements since
  std::vector<std::string> models_;  ///< as found, where they are chosen by evidence
  std::size_t chosen_from_ = 0;      ///< views
  std::size_t imu_views_ = 0;        ///< that the last fit had
  std::vector<WeakPart> imu_parts_;
  std::string imu_lacks_;  ///< why there is no fit with the IMU
};

}  // namespace fbvins
