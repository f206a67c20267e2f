// SPDX-License-Identifier: Apache-2.0
// The real recordings, where they are at hand.
#include "fbvins/io/dataset.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "fbvins/io/dataset_description.hpp"

namespace fbvins {
namespace dataset_test {

std::string data_folder() {
  const char* set = std::getenv("FBVINS_DATA");
  return set ? set : FBVINS_SOURCE_DIR "/../shared/data";
}

#define SKIP_WITHOUT(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there; set FBVINS_DATA"

struct Tally {
  int imu = 0, frames = 0, left = 0, right = 0, late_imu = 0;
};

/// Counts events and checks their order.
Tally drain(Dataset& data) {
  Tally tally;
  Time imu{-1}, image{-1};
  while (auto event = data.next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) {
      EXPECT_GT(sample->t, imu);
      imu = sample->t;
      ++tally.imu;
    } else {
      const auto& frame = std::get<StereoFrame>(*event);
      EXPECT_GT(frame.t, image);
      image = frame.t;
      ++tally.frames;
      tally.left += frame.left() != nullptr;
      tally.right += frame.right() != nullptr;
      if (imu < frame.t) ++tally.late_imu;
    }
  }
  return tally;
}

TEST(RealData, MachineHallIsReadWhole) {
  const std::string path = data_folder() + "/MH_01_easy_17s";
  SKIP_WITHOUT(path);
  auto data = open_dataset(path);
  ASSERT_TRUE(data) << data.error().message;
  const DatasetInfo& info = (*data)->info();
  EXPECT_EQ(info.name, "MH_01_easy_17s");
  EXPECT_EQ(info.frames, 340);
  EXPECT_EQ(info.imu_samples, 3531);
  EXPECT_NEAR(info.image_rate_hz, 20, 0.01);
  EXPECT_NEAR(info.imu_rate_hz, 200, 0.1);
  EXPECT_EQ(info.ground_truth_poses, 3531);
  EXPECT_EQ(info.first_image.ns, 1403636584763555584);
  EXPECT_TRUE(info.warnings.empty()) << info.warnings.front();
  EXPECT_NEAR((*data)->rig().T_C1C0().p.norm(), 0.11, 0.001);
  EXPECT_EQ((*data)->rig().left().width(), 752);
  EXPECT_DOUBLE_EQ((*data)->rig().imu_noise.gyro_noise_density_radps_rthz, 1.6968e-4);
  const Tally tally = drain(**data);
  EXPECT_EQ(tally.frames, 340);
  EXPECT_EQ(tally.left, 340);
  EXPECT_EQ(tally.right, 340);
  EXPECT_EQ(tally.imu, 3531);
  EXPECT_EQ(tally.late_imu, 0);
}

TEST(RealData, RoomAtRestHasOpencvYamlHeaders) {
  const std::string path = data_folder() + "/V1_01_easy_rest_3s/mav0";
  SKIP_WITHOUT(path);
  auto data = open_dataset(path);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data)->info().name, "V1_01_easy_rest_3s");
  EXPECT_EQ(drain(**data).frames, 60);
}

TEST(RealData, KeyframesAreJpegAndHaveNoImu) {
  const std::string path = data_folder() + "/V1_01_easy_keyframes";
  SKIP_WITHOUT(path);
  auto refused = open_dataset(path);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("imu0/sensor.yaml: no such file"), std::string::npos) << refused.error().message;
  auto data = open_dataset(path, {.require_imu = false});
  ASSERT_TRUE(data) << data.error().message;
  const Tally tally = drain(**data);
  EXPECT_EQ(tally.frames, 100);
  EXPECT_EQ(tally.left, 100);
  EXPECT_EQ(tally.imu, 0);
  EXPECT_EQ((*data)->info().ground_truth_poses, 2895);
}

TEST(DatasetTest, AnImuThatIsTooSlowIsSaid) {
  const auto said = [](int hz, double declared_hz) {
    DatasetContents contents;
    contents.rig.imu_noise.rate_hz = declared_hz;
    contents.frames.push_back({Time{0}, {"a"}});
    for (int i = 0; i < 100; ++i) contents.imu.push_back({Time{i * (1'000'000'000LL / hz)}, Vec3::Zero(), Vec3::Zero()});
    describe(contents);
    std::string out;
    for (const std::string& warning : contents.info.warnings)
      if (warning.find("readings a second") != std::string::npos) out += warning;
    return out;
  };
  EXPECT_EQ(
      said(8, 200),
      "IMU: 8 readings a second where 200 are declared, too few for an estimate (`imu_gap`, `alignment_refused`): set the sensor "
      "to 100 to 400 Hz");
  EXPECT_EQ(
      said(20, 20),
      "IMU: 20 readings a second, between which the motion is hardly known, so that the covariance is larger: set the sensor to "
      "100 to 400 Hz");
  EXPECT_EQ(said(100, 200), "");
}

}  // namespace dataset_test
}  // namespace fbvins
