// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/kalibr_imu.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "fbvins/io/camera_order.hpp"
#include "fbvins/io/foreign_files.hpp"

namespace fbvins {
namespace kalibr_imu_test {

constexpr const char* kNoise =
    "  accelerometer_noise_density: 0.01\n  accelerometer_random_walk: 0.0002\n  gyroscope_noise_density: 0.005\n"
    "  gyroscope_random_walk: 4.0e-06\n  update_rate: 200.0\n";
constexpr const char *kHere = "  T_i_b:\n  - [1, 0, 0, 0]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n",
                     *kTurned = "  T_i_b:\n  - [0, 1, 0, 0.5]\n  - [-1, 0, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n";

StereoRig rig() {
  const Camera camera(PinholeRadtan{400, 400, 320, 240}, 640, 480);
  StereoRig out =
      with_cameras({}, {{camera, {so3_exp({0.1, 0.2, 0.3}), Vec3(0.1, 0, 0)}}, {camera, {Quat::Identity(), Vec3(0, 0.1, 0)}}});
  out.time_offset_s = 0.01;
  return out;
}

std::string message(const Result<StereoRig>& read) { return read ? "read" : read.error().message; }

TEST(KalibrImu, PlaceAndClockAreUsed) {
  const std::string one = std::string("imu0:\n") + kTurned + "  time_offset: 0.004\n" + kNoise;
  const Result<StereoRig> read = with_imu_text(rig(), "imu.yaml", one, "");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->imu_noise.gyro_noise_density_radps_rthz, 0.005);
  // (x, y, z) of the body is (y + 0.5, -x, z) of the IMU.
  EXPECT_LT((read->T_BC0().p - Vec3(0.5, -0.1, 0)).norm(), 1e-12);
  EXPECT_LT((read->T_BC1().p - Vec3(0.6, 0, 0)).norm(), 1e-12);
  EXPECT_LT((read->T_C1C0().p - rig().T_C1C0().p).norm(), 1e-12) << "cameras stay where they are to one another";
  EXPECT_NEAR(read->time_offset_s, 0.006, 1e-12);
}

TEST(KalibrImu, WithoutAPlaceNothingMoves) {
  for (const std::string& text : {std::string("imu0:\n") + kNoise, std::string("imu0:\n") + kHere + kNoise}) {
    const Result<StereoRig> read = with_imu_text(rig(), "imu.yaml", text, "");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->T_BC0().p, rig().T_BC0().p);
    EXPECT_EQ(read->time_offset_s, 0.01);
  }
}

TEST(KalibrImu, OfSeveralOneIsNamed) {
  const std::string two = std::string("imu0:\n  rostopic: /a\n") + kHere + kNoise + "imu1:\n  rostopic: /b\n" + kTurned + kNoise;
  EXPECT_EQ(message(with_imu_text(rig(), "imu.yaml", two, "")),
            "imu.yaml: imu: there are several in different places, imu0 (/a) and imu1 (/b): say which one was recorded by a name "
            "behind the file's, --imu-calibration imu.yaml:imu1");
  EXPECT_LT((with_imu_text(rig(), "imu.yaml", two, "imu0")->T_BC0().p - rig().T_BC0().p).norm(), 1e-12);
  EXPECT_LT((with_imu_text(rig(), "imu.yaml", two, "imu1")->T_BC0().p - Vec3(0.5, -0.1, 0)).norm(), 1e-12);
  EXPECT_EQ(message(with_imu_text(rig(), "imu.yaml", two, "imu2")), "imu.yaml: imu2: is not there");
  EXPECT_NE(message(with_imu_file(rig(), "there/is/none.yaml:imu1")).find("there/is/none.yaml"), std::string::npos);
}

TEST(KalibrImu, OfSeveralTheOneWhoseTopicIsRecorded) {
  const std::string path = (std::filesystem::path(::testing::TempDir()) / "fbvins_imus.yaml").string();
  std::ofstream(path) << std::string("imu0:\n  rostopic: /a\n") + kHere + kNoise + "imu1:\n  rostopic: /b\n" + kTurned + kNoise;
  EXPECT_EQ(imu_of_topics(path, {"/left", "/b"}), path + ":imu1");
  EXPECT_EQ(imu_of_topics(path, {"/a"}), path + ":imu0");
  EXPECT_EQ(imu_of_topics(path, {"/a", "/b"}), path) << "either may be meant";
  EXPECT_EQ(imu_of_topics(path, {"/c"}), path);
  EXPECT_EQ(imu_of_topics("there/is/none.yaml", {"/a"}), "there/is/none.yaml");
  std::filesystem::remove(path);
}

TEST(KalibrImu, ImuUtilsHasTheAverageOfThreeAxes) {
  const std::string text =
      "%YAML:1.0\n---\ntype: IMU\nname: t\nGyr:\n   unit: \" rad/s\"\n   avg-axis:\n      gyr_n: 2e-4\n      gyr_w: 1e-5\nAcc:\n"
      "   avg-axis:\n      acc_n: 6e-3\n      acc_w: 5e-4\n";
  const Result<StereoRig> read = with_imu_text(rig(), "i.yaml", text, "");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->imu_noise.gyro_noise_density_radps_rthz, 2e-4);
  EXPECT_EQ(read->imu_noise.accel_random_walk_mps3_rthz, 5e-4);
  EXPECT_NE(message(with_imu_text(rig(), "i.yaml", "Gyr:\n  a: 1\nAcc:\n  b: 1\n", "")).find("gyr_n"), std::string::npos);
}

TEST(CameraOrder, ByTopicsWhereTheyNameAll) {
  using Numbers = std::vector<int>;
  const std::vector<std::string> chain{"/cam1/image_raw", "/cam0/image_raw"};
  EXPECT_EQ(order_by_topics(chain, {"/cam0/image_raw", "/cam1/image_raw"}), (Numbers{1, 0}));
  EXPECT_EQ(order_by_topics(chain, {"/cam0/image_raw/compressed", "cam1/image_raw"}), (Numbers{1, 0}));
  EXPECT_EQ(order_by_topics(chain, {"cam0", "cam1"}), (Numbers{1, 0}));
  EXPECT_EQ(order_by_topics(chain, {"/cam0/image_raw"}), Numbers{1});
  EXPECT_EQ(order_by_topics(chain, {"/cam1/image_raw", "/cam0/image_raw"}), Numbers{}) << "as they are numbered";
  EXPECT_EQ(order_by_topics(chain, {"/cam0/image_raw", "/left"}), Numbers{}) << "not all are named";
  EXPECT_EQ(order_by_topics({"/left", "/left"}, {"/left", "/left"}), Numbers{}) << "one name twice";
  EXPECT_EQ(order_by_topics({}, {"cam0"}), Numbers{});
  const StereoRig turned = in_order(rig(), {1, 0});
  EXPECT_EQ(turned.T_BC0().p, rig().T_BC1().p);
  EXPECT_EQ(turned.T_BC1().p, rig().T_BC0().p);
}

TEST(ForeignFiles, AreNamedWithWhatToDo) {
  EXPECT_EQ(foreign_file("a: 1\n"), "");
  EXPECT_EQ(foreign_file("target_type: aprilgrid\n"), "this is a board: give it to `fbvins calibrate` by --target");
  EXPECT_NE(foreign_file("cameras:\n - {T_SC: [1], image_dimension: [6, 4]}\n").find("OKVIS"), std::string::npos);
  EXPECT_NE(foreign_file("RadTan 0.5 0.5 0.5 0.5 0 0 0 0\n").find("DSO"), std::string::npos);
  EXPECT_NE(foreign_file("gyroscope_noise_density: 1\n").find("--imu-calibration"), std::string::npos);
}

}  // namespace kalibr_imu_test
}  // namespace fbvins
