// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera.hpp"

#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "fbvins/core/angle.hpp"
#include "fbvins/core/median.hpp"
#include "tests/support/imu_camera_scene.hpp"

namespace fbvins {
namespace imu_camera_test {

using test::hand_held;
using test::HandHeldOptions;
using test::HandHeldRecording;

/// As quick as a test should be: 12 s, images at 10 Hz.
HandHeldOptions short_recording() {
  HandHeldOptions o;
  o.duration_s = 12, o.image_rate_hz = 10;
  return o;
}

/// Errors within the sizes and within `sigmas` of their own standard deviations.
void expect_truth(const HandHeldRecording& r, const Result<CameraImuResult>& found, double worst_m, double worst_rad,
                  double worst_s, double sigmas = 3.5) {
  ASSERT_TRUE(found) << found.error().message;
  for (std::size_t c = 0; c < r.truth.T_BC.size(); ++c) {
    const CameraOnImu& camera = found->cameras[c];
    Vec6 error;
    error << camera.T_BC.p - r.truth.T_BC[c].p, so3_log(r.truth.T_BC[c].q.conjugate() * camera.T_BC.q);
    EXPECT_LT(error.head<3>().norm(), worst_m) << "camera " << c;
    EXPECT_LT(error.tail<3>().norm(), worst_rad) << "camera " << c;
    for (int k = 0; k < 6; ++k)
      EXPECT_LT(std::abs(error(k)), sigmas * std::sqrt(camera.covariance(k, k)) + 1e-6) << "camera " << c << ", " << k;
  }
  const double late_s = std::abs(found->time_offset_s - r.truth.time_offset_s);
  EXPECT_LT(late_s, worst_s);
  EXPECT_LT(late_s, sigmas * found->time_offset_sigma_s);
}

std::string refusal(const ImuCameraInput& input, const ImuCameraOptions& options = {}) {
  const Result<CameraImuResult> found = calibrate_imu_camera(input, options);
  return found ? "no refusal" : found.error().message;
}

void expect_refusal(const ImuCameraInput& input, const char* part, const ImuCameraOptions& options = {}) {
  const std::string message = refusal(input, options);
  EXPECT_NE(message.find(part), std::string::npos) << message;
}

TEST(ImuCamera, FindsWhatWasPutIn) {
  const HandHeldRecording r = hand_held(short_recording(), 1);
  const Result<CameraImuResult> found = calibrate_imu_camera(r.input, {});
  expect_truth(r, found, 0.8e-3, 0.01 * kDegree, 0.03e-3);
  EXPECT_NEAR(found->corner_sigma_px, 0.2, 0.003);
  EXPECT_NEAR(found->gyro_rms_sigmas, 1, 0.03);
  EXPECT_NEAR(found->accel_rms_sigmas, 1, 0.03);
  EXPECT_NEAR(found->board_scale, 1, 3.5 * found->board_scale_sigma);
  EXPECT_LT(found->board_scale_sigma, 2e-3);
  const Vec3 off = found->gravity_T - r.truth.gravity_T;
  EXPECT_LT(test::squared_sigmas(off, found->gravity_covariance), 16);
  for (const BiasAt& at : found->biases) {
    const ImuBias& truth = r.truth.bias_at(at.t);
    EXPECT_LT((at.bias.gyro_radps - truth.gyro_radps).cwiseQuotient(at.sigma.gyro_radps).norm(), 5);
    EXPECT_LT((at.bias.accel_mps2 - truth.accel_mps2).cwiseQuotient(at.sigma.accel_mps2).norm(), 5);
  }
}

TEST(ImuCamera, TheSameInputGivesTheSameBytes) {
  HandHeldOptions o = short_recording();
  o.cameras = 1, o.duration_s = 10;
  const HandHeldRecording r = hand_held(o, 2);
  const auto a = calibrate_imu_camera(r.input, {}), b = calibrate_imu_camera(r.input, {});
  ASSERT_TRUE(a) << a.error().message;
  EXPECT_EQ(a->covariance, b->covariance);
  EXPECT_EQ(a->cameras[0].T_BC.p, b->cameras[0].T_BC.p);
}

TEST(ImuCamera, FindsAnOffsetOfSecondsAndASecondCameraAlone) {
  HandHeldOptions o = short_recording();
  o.time_offset_s = -2.345;
  HandHeldRecording r = hand_held(o, 3);
  r.input.T_CnC0.clear();
  expect_truth(r, calibrate_imu_camera(r.input, {}), 0.8e-3, 0.01 * kDegree, 0.03e-3);
}

TEST(ImuCamera, ATimeOffsetOfEachCamera) {
  HandHeldOptions o = short_recording();
  o.cameras = 3, o.later_s = 0.007;
  HandHeldRecording r = hand_held(o, 9);
  r.input.T_CnC0.clear();
  const Result<CameraImuResult> found = calibrate_imu_camera(r.input, {.camera_offsets = true});
  expect_truth(r, found, 0.8e-3, 0.01 * kDegree, 0.03e-3);
  EXPECT_EQ(found->cameras[0].later_s, 0);
  for (std::size_t c = 1; c < 3; ++c) {
    const CameraOnImu& camera = found->cameras[c];
    EXPECT_LT(camera.later_sigma_s, 0.05e-3);
    EXPECT_NEAR(camera.later_s, o.later_s * static_cast<double>(c), 3.5 * camera.later_sigma_s) << "camera " << c;
  }
  EXPECT_LT(found->image_factor, 1.2);
}

TEST(ImuCamera, BearsWhatRecordingsBring) {
  HandHeldOptions o = short_recording();
  o.outlier_share = 0.02, o.blur_share = 0.15, o.dropped_share = 0.03, o.spike_share = 0.002;
  o.hidden_from_s = 5, o.hidden_to_s = 7.5;
  const HandHeldRecording r = hand_held(o, 4);
  const auto found = calibrate_imu_camera(r.input, {});
  expect_truth(r, found, 1e-3, 0.02 * kDegree, 0.05e-3);
  EXPECT_GT(found->cameras[0].outliers, 50);
  EXPECT_GT(found->readings_refused, 2);
}

TEST(ImuCamera, RollingShutter) {
  HandHeldOptions o = short_recording();
  o.cameras = 1, o.line_delay_s = 40e-6;
  const HandHeldRecording r = hand_held(o, 5);
  ImuCameraOptions options;
  options.line_delay = true;
  const auto found = calibrate_imu_camera(r.input, options);
  expect_truth(r, found, 1e-3, 0.02 * kDegree, 0.05e-3);
  EXPECT_NEAR(found->line_delay_s, o.line_delay_s, 3.5 * found->line_delay_sigma_s);
  EXPECT_LT(found->line_delay_sigma_s, 0.5e-6);
  // The same moment by moment as a global shutter sees it.
  o.line_delay_s = 0, o.corner_sigma_px = 0;
  const HandHeldRecording global = hand_held(o, 5);
  std::vector<double> off_px;
  for (const BoardView& view : found->global_views)
    for (const BoardView& same : global.input.views)
      if (std::abs((same.t - view.t).ns) < 10)
        for (const BoardCorner& corner : view.corners)
          for (const BoardCorner& truth : same.corners)
            if (truth.index == corner.index) off_px.push_back((truth.pixel - corner.pixel).norm());
  ASSERT_GT(off_px.size(), 10000u);
  EXPECT_LT(median_of(off_px), 0.3) << "their noise; as seen the median is several pixels";
}

TEST(ImuCamera, ScaleAndAxesOfTheImu) {
  HandHeldOptions o = short_recording();
  o.cameras = 1, o.duration_s = 20;
  o.axes.gyro << 1.01, 0.004, -0.006, 0.003, 0.995, 0.002, -0.001, 0.005, 1.003;
  o.axes.accel << 1.006, 0, 0, 0.004, 0.992, 0, -0.003, 0.002, 1.01;
  const HandHeldRecording r = hand_held(o, 6);
  ImuCameraOptions options;
  options.imu_axes = true;
  const auto found = calibrate_imu_camera(r.input, options);
  expect_truth(r, found, 3e-3, 0.2 * kDegree, 0.1e-3);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) {
      EXPECT_NEAR(found->axes.gyro(row, column), o.axes.gyro(row, column), 4 * found->axes_sigma.gyro(row, column))
          << row << column;
      EXPECT_LT(found->axes_sigma.gyro(row, column), 2e-3);
      const double largest = column <= row ? 4 * found->axes_sigma.accel(row, column) : 0;
      EXPECT_LE(std::abs(found->axes.accel(row, column) - o.axes.accel(row, column)), largest) << row << column;
    }
}

TEST(ImuCamera, SaysWhatIsNoisierThanGiven) {
  HandHeldOptions o = short_recording();
  o.cameras = 1, o.stamp_jitter_s = 1e-3;
  HandHeldRecording r = hand_held(o, 10);
  r.input.noise.gyro_noise_density_radps_rthz /= 3;
  const auto found = calibrate_imu_camera(r.input, {});
  expect_truth(r, found, 3e-3, 0.1 * kDegree, 0.4e-3);
  EXPECT_NEAR(found->stamp_jitter_s, 1e-3, 0.15e-3);
  EXPECT_NEAR(found->gyro_rms_sigmas, 3, 0.3);
  EXPECT_EQ(found->remarks.size(), 2u) << fmt::format("{}", fmt::join(found->remarks, "; "));
}

TEST(ImuCamera, NamesWrongUnitsAndSizes) {
  HandHeldOptions o = short_recording();
  o.cameras = 1;
  const HandHeldRecording r = hand_held(o, 7);
  ImuCameraInput wrong = r.input;
  for (ImuSample& s : wrong.imu) s.gyro_radps /= kDegree;
  expect_refusal(wrong, "degrees/s");
  wrong = r.input;
  for (ImuSample& s : wrong.imu) s.accel_mps2 /= 9.81;
  expect_refusal(wrong, "gives g");
  for (ImuSample& s : wrong.imu) s.accel_mps2 *= 1000;
  expect_refusal(wrong, "thousandths of g");
  wrong = r.input;
  for (ImuSample& s : wrong.imu) std::swap(s.gyro_radps, s.accel_mps2);
  expect_refusal(wrong, "columns are exchanged");
  wrong = r.input;
  for (ImuSample& s : wrong.imu) s.accel_mps2 *= -1;
  expect_refusal(wrong, "all of its signs are wrong");
  wrong = r.input;
  for (ImuSample& s : wrong.imu) s.t.ns /= 1000;
  expect_refusal(wrong, "microseconds");
  wrong = r.input;
  for (ImuSample& s : wrong.imu) s.accel_mps2 *= 1.05;
  expect_refusal(wrong, "accelerometer's scale");
  for (ImuSample& s : wrong.imu) s.accel_mps2 *= 1.5;
  ImuCameraOptions axes;
  axes.imu_axes = true;
  expect_refusal(wrong, "%: its unit is wrong", axes);
  wrong = r.input;
  for (ImuSample& s : wrong.imu) s.gyro_radps.x() *= -1, s.accel_mps2.x() *= -1;
  expect_refusal(wrong, "left-handed");
  wrong = r.input;
  wrong.board.size_m *= 1.1;  // the true tags are 88 mm
  expect_refusal(wrong, "88.");
  wrong = r.input;
  for (BoardView& view : wrong.views)
    for (BoardCorner& corner : view.corners) corner.pixel.x() = wrong.cameras[0].width() - 1 - corner.pixel.x();
  expect_refusal(wrong, "mirrored");
  wrong = r.input;
  wrong.board.columns = 4, wrong.board.rows = 9;
  expect_refusal(wrong, "do not lie as on this board");
}

TEST(ImuCamera, NamesWhatTheRecordingLacks) {
  HandHeldOptions o = short_recording();
  const HandHeldRecording good = hand_held(o, 8);
  ImuCameraInput wrong = good.input;
  wrong.imu = hand_held(o, 9).input.imu;
  expect_refusal(wrong, "at no offset");
  wrong = good.input;
  wrong.T_CnC0[1].p.x() += 0.006;
  expect_refusal(wrong, "relative to one another");
  wrong = good.input;
  wrong.noise.accel_random_walk_mps3_rthz = 0;
  expect_refusal(wrong, "not positive");
  wrong = good.input;
  wrong.imu.back().t = wrong.imu.back().t + Duration::from_seconds(1e6);
  expect_refusal(wrong, "hours");
  wrong = good.input;
  wrong.imu.clear();
  expect_refusal(wrong, "no IMU readings");
  wrong = good.input;
  for (ImuSample& s : wrong.imu) s.t = s.t + Duration::from_seconds(1000);
  expect_refusal(wrong, "while the IMU is there");
  wrong = good.input;
  std::erase_if(wrong.views, [](const BoardView& v) { return v.camera == 1; });
  expect_refusal(wrong, "camera 1 shows the board in 0 images");
  o.duration_s = 6;
  expect_refusal(hand_held(o, 8).input, "in common");
  o = short_recording();
  o.turning = Vec3(0, 0, 1), o.tremor = 0;
  expect_refusal(hand_held(o, 8).input, "one axis");
  o.turning = Vec3::Constant(1e-4);
  EXPECT_NE(refusal(hand_held(o, 8).input), "no refusal");
  o.turning = Vec3::Constant(0.1);
  expect_refusal(hand_held(o, 8).input, "hardly turned");
}

}  // namespace imu_camera_test
}  // namespace fbvins
