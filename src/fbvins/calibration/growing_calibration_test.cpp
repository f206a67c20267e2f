// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/growing_calibration.hpp"

#include <gtest/gtest.h>

#include "fbvins/calibration/simulated_board.hpp"
#include "tests/support/imu_camera_scene.hpp"

namespace fbvins {
namespace growing_calibration_test {

const Board kBoard{.columns = 6, .rows = 6, .size_m = 0.088, .spacing = 0.3};
constexpr double kNoise_px = 0.2;

Detections first_stamps(const Detections& all, int stamps) {
  Detections out{{}, all.sizes};
  const Time end{1'000'000'000 + stamps * 50'000'000ll};
  for (const BoardView& view : all.views)
    if (view.t < end) out.views.push_back(view);
  return out;
}

std::vector<BoardView> newest(const Detections& detections) {
  std::vector<BoardView> out;
  for (const BoardView& view : detections.views)
    if (view.t == detections.views.back().t) out.push_back(view);
  return out;
}

CalibrationProgress judged(GrowingCalibration& growing, const Detections& detections) {
  return growing.judge({detections, {}, newest(detections)});
}

TEST(GrowingCalibration, SaysWhatToDoUntilTheAimsAreReached) {
  const SimulatedRig rig = simulated_stereo(example_cameras()[0]);
  const Detections all = simulated_views(rig, kBoard, 200, kNoise_px, 7).detections;
  GrowingCalibration growing(kBoard, {.patience_s = 1000});  // whatever this machine does beside it
  const Detections nothing{{}, all.sizes};
  const CalibrationProgress before = growing.judge({nothing, {}, {}});
  EXPECT_EQ(before.action, "show the board to the cameras");
  EXPECT_FALSE(before.reached);
  bool reached = false;
  double lens_px = 1e9;
  for (const int stamps : {3, 8, 20, 60, 200, 200, 200, 200}) {
    const CalibrationProgress progress = judged(growing, first_stamps(all, stamps));
    ASSERT_EQ(progress.cameras.size(), 2u);
    EXPECT_EQ(progress.cameras[0].size, (ImageSize{752, 480}));
    reached = progress.reached;
    EXPECT_NE(reached, !progress.action.empty()) << "either the aims are reached or there is something to do";
    if (stamps == 3) {
      EXPECT_NE(progress.reason.find("too few"), std::string::npos) << progress.reason;
    }
    if (progress.parts.empty()) continue;
    EXPECT_NEAR(progress.noise_px, kNoise_px, 0.05);
    EXPECT_LT(progress.parts[0].sigma, lens_px * 1.2) << "more views, no less is known";
    lens_px = progress.parts[0].sigma;
  }
  EXPECT_TRUE(reached);
}

TEST(GrowingCalibration, CountsCornersWhereTheyWere) {
  SimulatedRig rig{{example_cameras()[0]}, {{}}};
  Detections all = simulated_views(rig, kBoard, 20, kNoise_px, 8).detections;
  for (BoardView& view : all.views) std::erase_if(view.corners, [](const BoardCorner& c) { return c.pixel.x() > 370; });
  GrowingCalibration growing(kBoard, {});
  const CalibrationProgress progress = judged(growing, all);
  const ImageCoverage& seen = progress.cameras[0];
  int left = 0, right = 0, corners = 0;
  for (int cell = 0; cell < seen.grid.count(); ++cell)
    (cell % seen.grid.columns < seen.grid.columns / 2 ? left : right) += seen.corners[static_cast<std::size_t>(cell)];
  for (const BoardView& view : all.views) corners += static_cast<int>(view.corners.size());
  EXPECT_EQ(left + right, corners);
  EXPECT_EQ(right, 0);
}

TEST(GrowingCalibration, AsksForTurnsThatTheImuNeeds) {
  test::HandHeldOptions options;
  options.duration_s = 12, options.image_rate_hz = 10, options.turning = Vec3(1, 0.3, 0.3);
  const auto recording = test::hand_held(options, 5);
  for (const bool enough : {false, true}) {
    GrowingOptions growing_options{.with_imu = true, .imu_noise = recording.input.noise};
    // The cameras are not at issue here.
    growing_options.aims.lens_px = growing_options.aims.baseline_m = growing_options.aims.between_cameras_rad = 1e6;
    if (!enough) growing_options.aims.lever_m = 1e-4;
    growing_options.cameras.models = {recording.input.cameras[0].model_name()};
    GrowingCalibration growing(recording.input.board, growing_options);
    Detections detections{recording.input.views, {}};
    for (int k = 0; k < 2; ++k)
      detections.sizes[k] = {recording.input.cameras[static_cast<std::size_t>(k)].width(),
                             recording.input.cameras[static_cast<std::size_t>(k)].height()};
    const CalibrationProgress progress = growing.judge({detections, recording.input.imu, {}});
    EXPECT_EQ(progress.reached, enough) << progress.action << ": " << progress.reason;
    if (!enough) {
      EXPECT_NE(progress.action.find("turn faster, to and fro, about the IMU's y and z axes"), std::string::npos)
          << progress.action << ": " << progress.reason;
    }
  }
}

}  // namespace growing_calibration_test
}  // namespace fbvins
