// SPDX-License-Identifier: Apache-2.0
// The klt frontend on real recordings, where they are at hand (FBVINS_DATA, see the data folder's README).
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "fbvins/frontend/klt_frontend.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins {
namespace klt_real_test {

std::filesystem::path data_folder() {
  if (const char* folder = std::getenv("FBVINS_DATA")) return folder;
  return std::filesystem::path(FBVINS_SOURCE_DIR) / "../shared/data";
}

/// Distances from the epipolar line of the calibration, px, over all stereo matches of a frame.
void add_epipolar_errors(const StereoRig& rig, const TrackedFrame& frame, std::vector<double>& errors) {
  const Pose<C1, C0> T_C1C0 = rig.T_C1C0();
  const Mat3 E = hat(T_C1C0.p) * T_C1C0.R();
  for (const TrackedFeature& feature : frame.features) {
    if (!feature.right()) continue;
    const Vec3 line = E * feature.left()->normalised.homogeneous();
    errors.push_back(std::abs(feature.right()->normalised.homogeneous().dot(line)) / line.head<2>().norm() *
                     rig.right().focal_px());
  }
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

struct Tally {
  double features = 0, stereo = 0, tracked = 0;
  int frames = 0;
  std::vector<double> epipolar_px;
};

/// Every frame through one frontend; without IMU, hence without prediction.
Tally run(const std::string& folder, int max_frames, double max_gap_s) {
  DatasetOptions options;
  options.max_frames = max_frames;
  options.require_imu = false;
  auto opened = open_dataset(folder, options);
  Tally tally;
  if (!opened) {
    ADD_FAILURE() << opened.error().message;
    return tally;
  }
  Dataset& data = **opened;
  KltFrontendOptions frontend_options;
  frontend_options.max_gap_s = max_gap_s;
  KltFrontend frontend(data.rig(), frontend_options);
  while (auto event = data.next()) {
    auto* stereo = std::get_if<StereoFrame>(&*event);
    if (stereo == nullptr) continue;
    SensorPacket packet;
    packet.id = FrameId{tally.frames++};
    packet.frame = *stereo;
    const TrackedFrame out = frontend.process(packet, StatePrior{});
    tally.features += static_cast<double>(out.features.size());
    tally.stereo += out.stats.stereo;
    tally.tracked += out.stats.tracked;
    add_epipolar_errors(data.rig(), out, tally.epipolar_px);
  }
  return tally;
}

TEST(KltOnRealImages, StereoMatchesOverAWholeFlight) {
  const auto folder = data_folder() / "V1_01_easy_keyframes";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  // The pairs are 0.05 s apart and more: nothing is followed from one to the next.
  const Tally tally = run(folder.string(), 100, 0.02);
  ASSERT_GE(tally.frames, 90);
  EXPECT_GE(tally.features / tally.frames, 130);
  EXPECT_GE(tally.stereo / tally.features, 0.6);
  EXPECT_LT(median(tally.epipolar_px), 0.4);
}

TEST(KltOnRealImages, FollowsShakenImagesWithoutPrediction) {
  const auto folder = data_folder() / "MH_01_easy_17s";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const Tally tally = run(folder.string(), 60, 0.6);
  ASSERT_EQ(tally.frames, 60);
  EXPECT_GE(tally.features / tally.frames, 130);
  EXPECT_GE(tally.tracked / tally.features, 0.8);
  EXPECT_GE(tally.stereo / tally.features, 0.6);
  EXPECT_LT(median(tally.epipolar_px), 0.35);
}

}  // namespace klt_real_test
}  // namespace fbvins
