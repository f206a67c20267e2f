// SPDX-License-Identifier: Apache-2.0
// From rendered images to a calibration: all steps of `fbvins calibrate`.
#include "fbvins/boards/board_flight.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "fbvins/calibration/camera_calibration.hpp"
#include "fbvins/calibration/detect_board.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {
namespace board_flight_test {

#ifdef FBVINS_WITH_APRILTAG

TEST(BoardFlight, ARenderedBoardGivesTheLensesThatTookIt) {
  const std::string folder = testing::TempDir() + "board_flight";
  std::filesystem::remove_all(folder);
  BoardFlightOptions options;
  options.board = {.columns = 4, .rows = 4, .size_m = 0.088, .spacing = 0.3};
  options.seconds = 12;
  options.image_rate_hz = 2;
  options.exposure_ms = 0.5;
  const Result<void> done = simulate_board(options, folder, {});
  ASSERT_TRUE(done) << done.error().message;
  Result<CameraRecording> recording = open_euroc_cameras(folder);
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->cameras.size(), 2u);
  EXPECT_EQ(recording->images.size(), 48u);
  EXPECT_GT(recording->imu.size(), 2000u);
  const Result<BoardSearch> found = detect_board(options.board, *recording, {.threads = 2});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->unreadable, 0);
  const auto calibrated = calibrate_cameras(found->detections, options.board, {.models = {"pinhole-radtan"}});
  ASSERT_TRUE(calibrated) << calibrated.error().message;
  EXPECT_LT(calibrated->noise_px, 0.06);
  const StereoRig rig = *board_flight_rig(options);
  const std::vector<double> got = lens_parameters(calibrated->cameras[0].camera.model()),
                            want = lens_parameters(rig.left().model());
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(got[k], want[k], 0.5) << k;
  const Pose<Cn, C0> T_C1C0 = rig.T_C1C0().cast_frames<Cn, C0>();
  EXPECT_LT((calibrated->cameras[1].T_CnC0.p - T_C1C0.p).norm(), 2e-4);
  EXPECT_LT(so3_log(calibrated->cameras[1].T_CnC0.q.conjugate() * T_C1C0.q).norm(), 5e-4);
  std::filesystem::remove_all(folder);
}

TEST(BoardFlight, ARecordingOfAnotherBoardIsRefused) {
  const std::string folder = testing::TempDir() + "board_flight_other";
  std::filesystem::remove_all(folder);
  BoardFlightOptions options;
  options.board = {.columns = 4, .rows = 4, .size_m = 0.088, .spacing = 0.3};
  options.seconds = 1;
  options.image_rate_hz = 3;
  ASSERT_TRUE(simulate_board(options, folder, {}));
  Result<CameraRecording> recording = open_euroc_cameras(folder);
  ASSERT_TRUE(recording);
  Board other = options.board;
  other.columns = other.rows = 2;
  const auto found = detect_board(other, *recording, {.threads = 1});
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message.find("it describes another board"), std::string::npos) << found.error().message;
  std::filesystem::remove_all(folder);
}

#endif

TEST(BoardFlight, TheImusAxesAreToldWhereTheyAreWrong) {
  const std::string folder = testing::TempDir() + "board_flight_axes";
  for (const double scale : {0.0, 0.01}) {
    std::filesystem::remove_all(folder);
    BoardFlightOptions options;
    options.cameras = 1, options.seconds = 1, options.image_rate_hz = 1;
    options.imu_scale = scale, options.imu_axes_deg = 50 * scale;
    ASSERT_TRUE(simulate_board(options, folder, {}));
    const Result<std::string> truth = read_file(folder + "/simulation.yaml", 1u << 16u);
    ASSERT_TRUE(truth);
    for (const char* name : {"gyro_axes: [", "accel_axes: ["})
      EXPECT_EQ(truth->find(name) != std::string::npos, scale > 0) << name;
  }
  std::filesystem::remove_all(folder);
}

TEST(BoardFlight, AnUnknownLensIsRefused) {
  const auto rig = board_flight_rig({.board = {}, .lens = "fov"});
  ASSERT_FALSE(rig);
  EXPECT_NE(rig.error().message.find("'fov' is no lens model"), std::string::npos);
}

}  // namespace board_flight_test
}  // namespace fbvins
