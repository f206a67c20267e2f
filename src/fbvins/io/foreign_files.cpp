// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/foreign_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <vector>

namespace fbvins {
namespace {

constexpr const char *
    kAsKalibr = "write its cameras as Kalibr's chain (docs/calibration.md, What is read)",
   *kCalibrate = "calibrate with `fbvins calibrate`",
   *kStereoPair =
       "calibrate with `fbvins calibrate`, or write Kalibr's chain with its rotation and translation (in metres) as T_cn_cnm1 and the "
       "T_cam_imu that it lacks",
   *kOffline = "`fbvins run` and `fbvins info` read it",
   *kOfDevice =
       "`--source d435i` reads the device's own calibration, and a bag of its driver has it with /tf_static; else "
       "calibrate with `fbvins calibrate`";

/// All of the words are in a file of that kind, and seldom in another.
struct Kind {
  std::vector<std::string_view> words;
  const char *what, *to_do;
};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{
      {{"Gyr:", "Acc:", "avg-axis"},
       "the noise of an IMU by imu_utils",
       "give it by --imu-calibration, beside a calibration of the cameras"},
      {{"target_type"}, "a board", "give it to `fbvins calibrate` by --target"},
      {{"body_T_cam0"}, "a configuration of VINS-Fusion", kOffline},
      {{"model_type", "projection_parameters", "imu_topic"}, "a configuration of VINS-Mono", kOffline},
      {{"model_type", "projection_parameters"},
       "a camera's file of camodocal (VINS), without the camera's place on the IMU",
       "give the configuration that names it"},
      {{"model_type", "mirror_parameters"},
       "a camera's file of camodocal (VINS), without the camera's place on the IMU",
       "give the configuration that names it"},
      {{"\"value0\"", "intrinsics"}, "Basalt's calibration", kOffline},
      {{"relative_config_imucam"}, "OpenVINS's configuration", kOffline},
      {{"T_imu_cam", "cam0"}, "OpenVINS's chain of cameras", kOffline},
      {{"Camera.type"}, "a configuration of ORB-SLAM3", kOffline},
      {{"Camera.fx"}, "a configuration of ORB-SLAM", kOffline},
      {{"camera_id", "T_BS"}, "a camera's file of Kimera-VIO", kOffline},
      {{"\"cameraData\""}, "a calibration of an OAK", kOffline},
      {{"T_SC", "image_dimension"},
       "a configuration of OKVIS",
       "write its cameras as Kalibr's chain: T_SC as T_imu_cam, focal_length and principal_point as intrinsics, image_dimension as "
       "resolution"},
      {{"T_SC", "focal_length"},
       "a configuration of OKVIS",
       "write its cameras as Kalibr's chain: T_SC as T_imu_cam, focal_length and principal_point as intrinsics"},
      {{"T_B_C", "cameras:"}, "a rig of cameras of maplab or SVO", "write its cameras as Kalibr's chain: T_B_C as T_imu_cam"},
      {{"CalibrationFile", "Camera0"}, "a configuration of ROVIO", kAsKalibr},
      {{"qCM_", "MrMC_"}, "a configuration of ROVIO", kAsKalibr},
      {{"opencv_storage"}, "a calibration by OpenCV, without the camera's place on the IMU", kCalibrate},
      {{"opencv-matrix", "camera_matrix"}, "a calibration by OpenCV, without the camera's place on the IMU", kCalibrate},
      {{"camera_matrix", "distortion_coefficients"},
       "a camera_info file of ROS, without the camera's place on the IMU",
       "write it as Kalibr's chain, with T_cam_imu"},
      {{"image_width", "camera_matrix"},
       "a camera_info file of ROS, without the camera's place on the IMU",
       "write it as Kalibr's chain, with T_cam_imu"},
      {{"distortion_model", "binning_x"},
       "a camera_info message of ROS, without the camera's place on the IMU",
       "write it as Kalibr's chain, with T_cam_imu"},
      {{"\"imus\"", "scale_and_alignment"},
       "the calibration of a RealSense's IMU",
       "give it by --imu-calibration, beside a calibration of the cameras"},
      {{"\"imus\""}, "the calibration of a RealSense's IMU", "give it by --imu-calibration, beside a calibration of the cameras"},
      {{"controls-laserpower"},
       "a RealSense's settings (a preset), no calibration",
       "the recording or the device has the calibration, else "
       "calibrate with `fbvins calibrate`"},
      {{"\"param-depthunits\""},
       "a RealSense's settings (a preset), no calibration",
       "the recording or the device has the calibration, else "
       "calibrate with `fbvins calibrate`"},
      {{"Intrinsic of", "PPX"},
       "a RealSense's lenses as rs-enumerate-devices prints them, without their place on the IMU",
       kOfDevice},
      {{"\"ppx\"", "\"coeffs\""}, "a RealSense's lens as its library has it, without the camera's place on the IMU", kOfDevice},
      {{"\"intrinsic_matrix\"", "\"width\""}, "a camera's lens in Open3D's form, without its place on the IMU", kCalibrate},
      {{"\"fl_x\"", "\"fl_y\""}, "a camera's lens in Nerfstudio's form, without its place on the IMU", kCalibrate},
      {{"imuToCamera"}, "a calibration of Spectacular AI's SDK", "write its cameras as Kalibr's chain: imuToCamera as T_cam_imu"},
      {{"[LEFT_CAM_"}, "a calibration of a ZED's cameras, without their place on the IMU", kCalibrate},
      {{"config.optical_flow"}, "Basalt's configuration", "give its calibration.json"},
      {{"gyroscope_noise_density"},
       "the noise of an IMU (Kalibr's imu.yaml)",
       "give it by --imu-calibration, beside a calibration of the cameras"},
      {{"T_BS", "camera_model"}, "a camera's sensor.yaml of EuRoC", "give the folder that has cam0 and imu0"},
      {{"T_BS", "sensor_type"}, "a sensor.yaml of EuRoC", "give the folder that has cam0 and imu0"},
      {{"M1:", "D1:"}, "OpenCV's calibration of a stereo pair, without its place on the IMU", kStereoPair},
      {{"K1:", "D1:"}, "OpenCV's calibration of a stereo pair, without its place on the IMU", kStereoPair},
      {{"cameraMatrix1", "distCoeffs1"}, "OpenCV's calibration of a stereo pair, without its place on the IMU", kStereoPair},
      {{"Calibration results", "cam0"}, "Kalibr's report as text", "give the camchain-imucam.yaml that Kalibr wrote beside it"},
      {{"stereoParameters"}, "a calibration of a stereo pair as MATLAB prints it, without its place on the IMU", kStereoPair},
      {{"IntrinsicMatrix", "RadialDistortion"}, "a camera's lens as MATLAB prints it, without its place on the IMU", kCalibrate},
      {{"cameraParameters with properties"}, "a camera's lens as MATLAB prints it, without its place on the IMU", kCalibrate},
      {{"fc_left", "kc_left"}, "a calibration of a stereo pair by Bouguet's toolbox, without its place on the IMU", kStereoPair},
      {{"fc = [", "cc = ["}, "a camera's lens by Bouguet's toolbox (MATLAB), without its place on the IMU", kCalibrate},
      {{"stereo_calibration"}, "a calibration of a stereo pair, without its place on the IMU", kCalibrate},
      {{"P0:", "P1:"},
       "KITTI's calibration of rectified images, without the cameras' place on the IMU",
       "write its cameras as Kalibr's chain: fx, cx, cy of P0 and P1 without distortion, and the shift -P1[3] / fx between them"},
      {{"VERTEX_SE3:QUAT"},
       "a graph of poses in g2o's form, without times",
       "poses with stamps are compared, as TUM's or EuRoC's rows"},
      {{"Image list with two lines of data per image"},
       "COLMAP's list of images, with poses but without stamps",
       "poses with stamps are compared, as TUM's or EuRoC's rows"},
      {{"Camera list with one line of data per camera"}, "COLMAP's list of cameras, without their place on the IMU", kCalibrate},
      {{"cam_left", "T_cam_left"}, "a configuration of cameras", kAsKalibr},
      {{"estimator:"}, "a configuration of this program", "give it by --config"},
      {{"frontend:"}, "a configuration of this program", "give it by --config"},
  };
  return all;
}

bool begins_with_dso_model(std::string_view text) {
  constexpr std::string_view kModels[] = {"RadTan ", "Pinhole ", "FOV ", "EquiDistant ", "KannalaBrandt "};
  return std::ranges::any_of(kModels, [&](std::string_view model) { return text.starts_with(model); });
}

}  // namespace

std::string foreign_file(const std::string& text) {
  if (begins_with_dso_model(text))
    return fmt::format("this is a camera's file of DSO or DM-VIO, without its place on the IMU: {}", kAsKalibr);
  for (const Kind& kind : kinds())
    if (std::ranges::all_of(kind.words, [&](std::string_view word) { return text.find(word) != std::string::npos; }))
      return fmt::format("this is {}: {}", kind.what, kind.to_do);
  return "";
}

}  // namespace fbvins
