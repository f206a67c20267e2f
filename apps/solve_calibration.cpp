// SPDX-License-Identifier: Apache-2.0
#include "apps/solve_calibration.hpp"

#include <fmt/format.h>

#include "fbvins/imu/reading_rate.hpp"

namespace fbvins::app {
namespace {

/// Of a rolling shutter lenses are calibrated again from corners as the middle row's instant would have them, which takes the
/// path that the first lenses gave.
constexpr int kRollingRounds = 2;

/// With the measured rate, on which the noise of a single reading depends.
ImuNoise noise_of(const CalibrationMaterial& material, std::vector<std::string>& remarks) {
  if (!material.imu_noise)
    remarks.push_back(
        "no noise of the IMU is given (--imu-calibration): the defaults are taken, and the weight of its readings follows their residuals");
  ImuNoise noise = material.imu_noise.value_or(ImuNoise{});
  if (const double rate_hz = rate_hz_of(material.imu); rate_hz > 0) noise.rate_hz = rate_hz;
  return noise;
}

/// The readings as the given axes correct them; as they are where the axes are estimated.
std::vector<ImuSample> readings_of(const CalibrationMaterial& material, const ImuNoise& noise, bool estimated) {
  std::vector<ImuSample> out = material.imu;
  if (!estimated)
    for (ImuSample& reading : out) reading = corrected(reading, noise.axes);
  return out;
}

class RigSolver {
 public:
  RigSolver(const Board& board, const CalibrationMaterial& material, const CameraCalibrationOptions& cameras,
            const ImuCameraOptions& imu)
      : board_(board),
        material_(material),
        options_(cameras),
        imu_options_(imu),
        // Cameras that never see the board together, or not at one time, are joined by the IMU, if there is one.
        connected_(cameras_connected(material.detections, board, cameras.pair_tolerance_s)),
        apart_(!material.imu.empty() && (imu.camera_offsets || !connected_)) {}

  Result<CalibrationOutcome> solve() {
    outcome_.board = board_;
    outcome_.remarks = material_.remarks;
    if (Result<void> done = calibrate_lenses(material_.detections); !done) return done.error();
    if (material_.imu.empty()) {
      say_what_cameras_cannot_see();
      return std::move(outcome_);
    }
    tell(fmt::format("cameras on the IMU: {} readings", material_.imu.size()));
    outcome_.imu_noise = noise_of(material_, outcome_.remarks);
    if (Result<void> done = mount_on_imu(); !done) return done.error();
    for (int round = 0; imu_options_.line_delay && round < kRollingRounds; ++round) {
      tell("lenses by corners as the middle row's instant has them");
      if (Result<void> done = calibrate_lenses({outcome_.imu->global_views, material_.detections.sizes}); !done)
        return done.error();
      if (Result<void> done = mount_on_imu(); !done) return done.error();
    }
    if (!connected_ && apart_)
      outcome_.remarks.push_back("cameras without common views of the board: their poses to one another come from the IMU");
    return std::move(outcome_);
  }

 private:
  void tell(const std::string& what) const {
    if (options_.on_progress) options_.on_progress(what);
  }

  void say_what_cameras_cannot_see() {
    outcome_.remarks.push_back(fmt::format(
        "all lengths are those of the board's file ({:g} mm): without an IMU nothing shows whether the print has them, "
        "so measure it; a baseline is wrong by the same factor",
        1e3 * board_.size_m));
  }

  Result<void> calibrate_lenses(const Detections& detections) {
    Result<CameraCalibration> cameras =
        apart_ ? calibrate_cameras_apart(detections, board_, options_) : calibrate_cameras(detections, board_, options_);
    if (!cameras) return cameras.error();
    outcome_.cameras = *std::move(cameras);
    return {};
  }

  Result<void> mount_on_imu() {
    ImuCameraInput input{board_,
                         {},
                         {},
                         material_.detections.views,
                         readings_of(material_, outcome_.imu_noise, imu_options_.imu_axes),
                         outcome_.imu_noise,
                         rig_variations(outcome_.cameras)};
    for (const CalibratedCamera& camera : outcome_.cameras.cameras) {
      input.cameras.push_back(camera.camera);
      if (!apart_) input.T_CnC0.push_back(camera.T_CnC0);
    }
    Result<CameraImuResult> imu = calibrate_imu_camera(input, imu_options_);
    if (!imu) return Error{imu.error().code, imu.error().message + " (--cameras-only calibrates the cameras alone)"};
    for (std::size_t k = 0; apart_ && k < imu->cameras.size(); ++k)
      outcome_.cameras.cameras[k].T_CnC0 = imu->cameras[k].T_BC.inverse() * imu->cameras[0].T_BC.cast_frames<B, C0>();
    outcome_.imu = *std::move(imu);
    return {};
  }

  const Board& board_;
  const CalibrationMaterial& material_;
  const CameraCalibrationOptions& options_;
  const ImuCameraOptions& imu_options_;
  const bool connected_, apart_;
  CalibrationOutcome outcome_;
};

}  // namespace

Result<CalibrationOutcome> solve_calibration(const Board& board, const CalibrationMaterial& material,
                                             const CameraCalibrationOptions& cameras, const ImuCameraOptions& imu) {
  return RigSolver(board, material, cameras, imu).solve();
}

}  // namespace fbvins::app
