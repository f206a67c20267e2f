// SPDX-License-Identifier: Apache-2.0
// The orb frontend on real recordings, where they are at hand (FBVINS_DATA, see the data folder's README).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "fbvins/frontend/orb_frontend.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins {
namespace orb_real_test {

std::filesystem::path data_folder() {
  if (const char* folder = std::getenv("FBVINS_DATA")) return folder;
  return std::filesystem::path(FBVINS_SOURCE_DIR) / "../shared/data";
}

struct Tally {
  double features = 0, stereo = 0, tracked = 0;
  int frames = 0;
  std::vector<double> epipolar_px;  // of stereo matches, from the calibration

  double median_epipolar_px() {
    const auto middle = epipolar_px.begin() + static_cast<std::ptrdiff_t>(epipolar_px.size() / 2);
    std::nth_element(epipolar_px.begin(), middle, epipolar_px.end());
    return *middle;
  }
};

/// Without IMU, hence without prediction.
Tally run(const std::filesystem::path& folder, int max_frames) {
  DatasetOptions dataset_options;
  dataset_options.max_frames = max_frames;
  dataset_options.require_imu = false;
  Tally tally;
  auto opened = open_dataset(folder.string(), dataset_options);
  if (!opened) {
    ADD_FAILURE() << opened.error().message;
    return tally;
  }
  Dataset& data = **opened;
  const Pose<C1, C0> T_C1C0 = data.rig().T_C1C0();
  const Mat3 E = hat(T_C1C0.p) * T_C1C0.R();
  OrbFrontendOptions options;
  options.stereo_epipolar_px = 3.0;
  OrbFrontend frontend(data.rig(), options);
  while (auto event = data.next()) {
    const auto* stereo = std::get_if<StereoFrame>(&*event);
    if (stereo == nullptr) continue;
    const TrackedFrame frame = frontend.process({FrameId{tally.frames++}, *stereo, {}}, StatePrior{});
    tally.features += static_cast<double>(frame.features.size());
    tally.stereo += frame.stats.stereo;
    tally.tracked += frame.stats.tracked;
    for (const TrackedFeature& f : frame.features) {
      if (!f.right()) continue;
      const Vec3 line = E * f.left()->normalised.homogeneous();
      tally.epipolar_px.push_back(std::abs(f.right()->normalised.homogeneous().dot(line)) / line.head<2>().norm() *
                                  data.rig().right().focal_px());
    }
  }
  return tally;
}

TEST(OrbFrontendOnRealImages, FollowsAndMatchesTheMachineHall) {
  const auto folder = data_folder() / "MH_01_easy_17s";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is absent";
  Tally fine = run(folder, 40);
  EXPECT_EQ(fine.frames, 40);
  EXPECT_GT(fine.features / fine.frames, 120);
  EXPECT_GT(fine.tracked / fine.frames, 100);
  EXPECT_GT(fine.stereo / fine.features, 0.6);
  EXPECT_LT(fine.median_epipolar_px(), 0.35);
}

TEST(OrbFrontendOnRealImages, StereoOnKeyframesFarApart) {
  const auto folder = data_folder() / "V1_01_easy_keyframes";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is absent";
  Tally tally = run(folder, 30);
  EXPECT_EQ(tally.frames, 30);
  EXPECT_GT(tally.stereo / tally.features, 0.5);
  EXPECT_LT(tally.median_epipolar_px(), 0.5);
}

}  // namespace orb_real_test
}  // namespace fbvins
