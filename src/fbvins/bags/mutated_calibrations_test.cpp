// SPDX-License-Identifier: Apache-2.0
// Good calibrations with one mistake each: every one is refused, or warned of.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "fbvins/bags/calibration.hpp"
#include "fbvins/io/calibration_doubts.hpp"

namespace fbvins {
namespace mutated_calibrations_test {

namespace fs = std::filesystem;

const std::string kChain = R"(cam0:
  T_cam_imu:
  - [0.0148655429818, 0.999557249008, -0.0257744366974, 0.06522290953]
  - [-0.999880929698, 0.0149672133247, 0.00375618835797, -0.0207063854]
  - [0.00414029679422, 0.025715529948, 0.999660727178, -0.0080546022]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: 0.001
cam1:
  T_cn_cnm1:
  - [0.999997256477881, 0.002312067192424, 0.000376008102415, -0.110073808127187]
  - [-0.002317135723281, 0.999898048506644, 0.014089835846648, 0.000399121547014]
  - [-0.000343393120525, -0.014090668452714, 0.999900662637729, -0.000853702503357]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.28368365, 0.07451284, -0.00010473, -3.555907e-05]
  distortion_model: radtan
  intrinsics: [457.587, 456.134, 379.999, 255.238]
  resolution: [752, 480]
  rostopic: /cam1/image_raw
  timeshift_cam_imu: 0.001
)";
const std::string kImu = R"(accelerometer_noise_density: 0.002
accelerometer_random_walk: 0.003
gyroscope_noise_density: 0.00016968
gyroscope_random_walk: 1.9393e-05
rostopic: /imu0
time_offset: 0.0
update_rate: 200.0
)";
const std::string kMono = R"(%YAML:1.0

imu_topic: "/imu0"
model_type: PINHOLE
image_width: 752
image_height: 480
distortion_parameters:
   k1: -0.28
   k2: 0.07
   p1: 0
   p2: 0
projection_parameters:
   fx: 460
   fy: 461
   cx: 370
   cy: 240
estimate_extrinsic: 0
extrinsicRotation: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [0.0148655, -0.9998809, 0.0041403, 0.9995572, 0.0149672, 0.0257155, -0.0257744, 0.0037562, 0.9996607]
extrinsicTranslation: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [-0.0216, -0.0647, 0.0098]
acc_n: 0.08
gyr_n: 0.004
acc_w: 0.00004
gyr_w: 2.0e-6
td: 0.001
)";
const std::string kBasalt =
    R"({"value0": {"T_imu_cam": [{"px": -0.0216, "py": -0.0647, "pz": 0.0098, "qx": 0, "qy": 0, "qz": 0.7071067811865476,
 "qw": 0.7071067811865476}, {"px": -0.0198, "py": 0.0453, "pz": 0.0078, "qx": 0, "qy": 0, "qz": 0.7071067811865476, "qw": 0.7071067811865476}],
 "intrinsics": [{"camera_type": "kb4", "intrinsics": {"fx": 380.5, "fy": 380.25, "cx": 376, "cy": 240, "k1": 0.01, "k2": 0.02, "k3": -0.03,
 "k4": 0.004}}, {"camera_type": "kb4", "intrinsics": {"fx": 380.5, "fy": 380.25, "cx": 376, "cy": 240, "k1": 0.01, "k2": 0.02, "k3": -0.03,
 "k4": 0.004}}], "resolution": [[752, 480], [752, 480]], "cam_time_offset_ns": 2000000, "imu_update_rate": 200.0,
 "accel_noise_std": [0.016, 0.016, 0.016], "gyro_noise_std": [0.000282, 0.000282, 0.000282],
 "accel_bias_std": [0.001, 0.001, 0.001], "gyro_bias_std": [0.0001, 0.0001, 0.0001]}})";

struct Mistake {
  std::string from, to;
};

class MutatedCalibrations : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  /// What is said of them; empty: nothing.
  std::string said(const std::string& calibration, const std::string& imu = "") {
    const Result<StereoRig> rig = load_calibration(write("a.yaml", calibration), imu.empty() ? "" : write("imu.yaml", imu));
    if (!rig) return rig.error().message;
    std::string out;
    for (const std::string& doubt : calibration_doubts(*rig)) out += doubt + "\n";
    return out;
  }
  static std::string with(std::string text, const Mistake& mistake) {
    const std::size_t at = text.find(mistake.from);
    EXPECT_NE(at, std::string::npos) << mistake.from;
    return at == std::string::npos ? text : text.replace(at, mistake.from.size(), mistake.to);
  }

  fs::path folder_ = fs::temp_directory_path() / fmt::format("fbvins_mutated_{}", ::getpid());
};

TEST_F(MutatedCalibrations, GoodOnesAreTaken) {
  EXPECT_EQ(said(kChain, kImu), "");
  EXPECT_EQ(said(kMono), "");
  EXPECT_EQ(said(kBasalt), "");
}

TEST_F(MutatedCalibrations, WhatIsGivenTwiceAgrees) {
  const auto doubts = [&](const std::string& mounting) {
    return chain_doubts(write("a.yaml", with(kChain, {"  camera_model", "  T_imu_cam: " + mounting + "\n  camera_model"})));
  };
  EXPECT_TRUE(doubts("[[0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975], [0.999557249008, 0.0149672133247, "
                     "0.025715529948, -0.064676986768], [-0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949], "
                     "[0, 0, 0, 1]]")
                  .empty());
  const auto other = doubts("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]");
  ASSERT_EQ(other.size(), 1u);
  EXPECT_NE(other[0].find("cam0's T_imu_cam contradicts T_cam_imu: camera and IMU are 0.0000 m apart by the one, 0.0689 m by the "
                          "other, and turned by 89.1"),
            std::string::npos)
      << other[0];
}

TEST_F(MutatedCalibrations, KalibrsChain) {
  const std::vector<Mistake> mistakes = {
      {"cam0:", "cam2:"},
      {"T_cam_imu", "T_imu"},
      {"T_cn_cnm1", "T_cnm1_cn"},
      {"camera_model: pinhole", "camera_model: pinhol"},
      {"camera_model: pinhole\n", ""},
      {"distortion_model: radtan", "distortion_model: fov"},
      {"distortion_model: radtan\n", ""},
      {"distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n", ""},
      {"-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05", "-0.28340811, 0.07395907, 0.00019359"},
      {"-0.28340811", ".nan"},
      {"-0.28340811", "minus"},
      {"-0.28340811", "-28.340811"},
      {"intrinsics: [458.654, 457.296, 367.215, 248.375]\n", ""},
      {"458.654, 457.296, 367.215, 248.375", "458.654, 457.296, 367.215"},
      {"458.654", "-458.654"},
      {"458.654", "0"},
      {"458.654", "4.58654"},
      {"458.654", "45865.4"},
      {"458.654, 457.296", "0.458654, 0.457296"},
      {"458.654", "458.654e3"},
      {"458.654, 457.296, 367.215, 248.375", "367.215, 248.375, 458.654, 457.296"},
      {"367.215, 248.375", "-367.215, 248.375"},
      {"367.215, 248.375", "367.215, 2483.75"},
      {"367.215, 248.375", "0.367215, 0.248375"},
      {"resolution: [752, 480]\n", ""},
      {"resolution: [752, 480]", "resolution: [752]"},
      {"resolution: [752, 480]", "resolution: [0, 480]"},
      {"resolution: [752, 480]", "resolution: [-752, 480]"},
      {"resolution: [752, 480]", "resolution: [752, 480, 3]"},
      {"resolution: [752, 480]", "resolution: [75200, 480]"},
      {"[0.0148655429818, 0.999557249008", "[-0.0148655429818, 0.999557249008"},
      {"- [0.0148655429818, 0.999557249008, -0.0257744366974, 0.06522290953]\n", ""},
      {"0.999557249008, -0.0257744366974, 0.06522290953", "0.999557249008, -0.0257744366974"},
      {"0.999557249008", "1.999557249008"},
      {"0.06522290953", ".inf"},
      {"0.06522290953", "65222.90953"},
      {"- [0.0, 0.0, 0.0, 1.0]", "- [0.0, 0.0, 0.0, 2.0]"},
      {"- [0.0, 0.0, 0.0, 1.0]", "- [0.1, 0.0, 0.0, 1.0]"},
      {"-0.110073808127187", "-110.073808127187"},
      {"-0.110073808127187", "0"},
      {"0.999898048506644", "-0.999898048506644"},
      {"timeshift_cam_imu: 0.001", "timeshift_cam_imu: 1.0"},
      {"timeshift_cam_imu: 0.001", "timeshift_cam_imu: 1000"},
      {"timeshift_cam_imu: 0.001", "timeshift_cam_imu: soon"},
      {"timeshift_cam_imu: 0.001", "timeshift_cam_imu: 0.001\n  line_delay: 20.0"},
      {"timeshift_cam_imu: 0.001", "timeshift_cam_imu: 0.001\n  line_delay: -0.00002"},
      {"cam1:", "cam1"},
      {"  T_cam_imu:", "\tT_cam_imu:"},
  };
  for (const Mistake& m : mistakes) EXPECT_NE(said(with(kChain, m), kImu), "") << m.from << " -> " << m.to;
  EXPECT_GE(mistakes.size(), 45u);
}

TEST_F(MutatedCalibrations, KalibrsImu) {
  const std::vector<Mistake> mistakes = {
      {"accelerometer_noise_density: 0.002\n", ""},
      {"accelerometer_noise_density: 0.002", "accelerometer_noise_density: 2.0"},
      {"accelerometer_noise_density: 0.002", "accelerometer_noise_density: 0.000002"},
      {"accelerometer_noise_density: 0.002", "accelerometer_noise_density: -0.002"},
      {"accelerometer_noise_density: 0.002", "accelerometer_noise_density: 0"},
      {"accelerometer_noise_density: 0.002", "accelerometer_noise_density: [0.002, 0.002, 0.002]"},
      {"accelerometer_random_walk: 0.003\n", ""},
      {"accelerometer_random_walk: 0.003", "accelerometer_random_walk: 3.0"},
      {"accelerometer_random_walk: 0.003", "accelerometer_random_walk: .nan"},
      {"gyroscope_noise_density: 0.00016968\n", ""},
      {"gyroscope_noise_density: 0.00016968", "gyroscope_noise_density: 0.16968"},
      {"gyroscope_noise_density: 0.00016968", "gyroscope_noise_density: 0.01"},
      {"gyroscope_noise_density: 0.00016968", "gyroscope_noise_density: 1.6968e-7"},
      {"gyroscope_random_walk: 1.9393e-05", "gyroscope_random_walk: 1.9393"},
      {"gyroscope_random_walk: 1.9393e-05", "gyroscope_random_walk: 0"},
      {"gyroscope_random_walk: 1.9393e-05\n", ""},
      {"update_rate: 200.0", "update_rate: 0"},
      {"update_rate: 200.0", "update_rate: -200"},
      {"update_rate: 200.0", "update_rate: often"},
      {"time_offset: 0.0", "time_offset: 5.0"},
      {"rostopic: /imu0", "rostopic: /imu0\nT_i_b:\n- [1, 0, 0, 0]\n- [0, 2, 0, 0]\n- [0, 0, 1, 0]\n- [0, 0, 0, 1]"},
  };
  for (const Mistake& m : mistakes) EXPECT_NE(said(kChain, with(kImu, m)), "") << m.from << " -> " << m.to;
}

TEST_F(MutatedCalibrations, OfOthers) {
  const std::vector<Mistake> mono = {
      {"image_width: 752\n", ""},
      {"model_type: PINHOLE", "model_type: PINHOL"},
      {"fx: 460", "fx: 0"},
      {"fx: 460\n", ""},
      {"cx: 370", "cx: -3700"},
      {"k1: -0.28\n", ""},
      {"[0.0148655, -0.9998809", "[0.0148655, 0.9998809"},
      {"0.9996607]", "0.9996607, 1]"},
      {"[-0.0216, -0.0647, 0.0098]", "[-21.6, -64.7, 9.8e3]"},
      {"acc_n: 0.08", "acc_n: -0.08"},
      {"gyr_n: 0.004", "gyr_n: 40"},
      {"td: 0.001", "td: 10"},
  };
  for (const Mistake& m : mono) EXPECT_NE(said(with(kMono, m)), "") << m.from << " -> " << m.to;
  const std::vector<Mistake> basalt = {
      {"\"qw\": 0.7071067811865476", "\"qw\": 1.7071067811865476"},
      {"\"px\": -0.0216", "\"px\": -21.6"},
      {"\"camera_type\": \"kb4\"", "\"camera_type\": \"kb5\""},
      {"\"fx\": 380.5", "\"fx\": -380.5"},
      {"\"fx\": 380.5, ", ""},
      {"[[752, 480], [752, 480]]", "[[752, 480]]"},
      {"2000000", "2000000000000"},
      {"[0.016, 0.016, 0.016]", "[0.016, 0.016]"},
      {"[0.016, 0.016, 0.016]", "[16, 16, 16]"},
      {"[0.000282, 0.000282, 0.000282]", "[0, 0, 0]"},
      {"\"imu_update_rate\": 200.0", "\"imu_update_rate\": 0"},
      {"}}", "}"},
  };
  for (const Mistake& m : basalt) EXPECT_NE(said(with(kBasalt, m)), "") << m.from << " -> " << m.to;
}

}  // namespace mutated_calibrations_test
}  // namespace fbvins
