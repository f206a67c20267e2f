// SPDX-License-Identifier: Apache-2.0
// Kalibr's yaml formats: https://github.com/ethz-asl/kalibr/wiki/yaml-formats
#include "fbvins/io/kalibr.hpp"

#include <fmt/format.h>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/foreign_files.hpp"
#include "fbvins/io/imu_axes_fields.hpp"
#include "fbvins/io/kalibr_imu.hpp"

namespace fbvins {
namespace {

/// T_CB of a camera: given directly, or through the one before.
Pose<C0, B> read_next_camera(YamlReader& yaml, const YAML::Node& camera, const Pose<C0, B>& T_before_B) {
  if (yaml.has(camera, "T_cam_imu")) return read_transform<C0, B>(yaml, camera, "T_cam_imu");
  return read_transform<C0, C0>(yaml, camera, "T_cn_cnm1") * T_before_B;
}

/// imu_utils: the averages of three axes. Its "white noise" is that of Kalibr's density for the rate of 1 Hz that its older
/// versions assume; newer ones give it times the root of the rate, which they do not write: the larger figure is the safe one.
/// Its bias instability stands for the random walk.
ImuNoise imu_utils_noise(YamlReader& yaml) {
  ImuNoise noise;
  const auto figure = [&](const char* sensor, const char* name) {
    return yaml.positive(yaml.get(yaml.get(yaml.root(), sensor), "avg-axis"), name);
  };
  noise.gyro_noise_density_radps_rthz = figure("Gyr", "gyr_n");
  noise.gyro_random_walk_radps2_rthz = figure("Gyr", "gyr_w");
  noise.accel_noise_density_mps2_rthz = figure("Acc", "acc_n");
  noise.accel_random_walk_mps3_rthz = figure("Acc", "acc_w");
  return noise;
}

}  // namespace

Result<StereoRig> parse_kalibr_camchain(YamlReader yaml, const ReadBeside& read) {
  const YAML::Node cam0 = yaml.get(yaml.root(), "cam0");
  if (!cam0.IsMap()) yaml.complain(yaml.root(), "cam0", "is missing or empty");
  Pose<C0, B> T_CB = read_transform<C0, B>(yaml, cam0, "T_cam_imu");
  std::vector<MountedCamera> cameras{{read_real_camera(yaml, cam0, "distortion_coeffs", read), T_CB.inverse()}};
  std::vector<CameraTimes> times{read_camera_times(yaml, cam0, 0)};
  for (int i = 1; yaml.get(yaml.root(), fmt::format("cam{}", i)).IsDefined(); ++i) {
    const std::string name = fmt::format("cam{}", i);
    const YAML::Node camera = yaml.get(yaml.root(), name);
    if (!camera.IsMap()) yaml.complain(yaml.root(), name, "is empty");
    if (!yaml.ok()) break;
    T_CB = read_next_camera(yaml, camera, T_CB);
    cameras.push_back({read_real_camera(yaml, camera, "distortion_coeffs", read), T_CB.inverse()});
    times.push_back(read_camera_times(yaml, camera, times.front().time_offset_s));
  }
  if (!yaml.ok()) return yaml.error();
  const StereoRig rig = with_times(with_cameras({}, cameras), times);
  if (Result<void> good = check_rig(rig, yaml.file()); !good) return good.error();
  return rig;
}

Result<ImuNoise> parse_imu(YamlReader yaml, const ImuNoise& otherwise, const std::string& name) {
  if (yaml.has(yaml.root(), "Gyr") && yaml.has(yaml.root(), "Acc")) {
    const ImuNoise noise = imu_utils_noise(yaml);
    return yaml.ok() ? Result<ImuNoise>(noise) : yaml.error();
  }
  if (is_realsense_imu(yaml)) {
    ImuNoise noise = otherwise;
    noise.axes = read_realsense_imu(yaml);
    return yaml.ok() ? Result<ImuNoise>(noise) : yaml.error();
  }
  const YAML::Node nested = yaml.get(yaml.root(), name);
  const ImuNoise noise = read_imu_noise(yaml, nested.IsDefined() ? nested : yaml.root(), "update_rate");
  if (!yaml.ok()) return yaml.error();
  return noise;
}

Result<StereoRig> load_kalibr(const std::string& camchain_path, const std::optional<std::string>& imu_path,
                              const ImuNoise& otherwise) {
  Result<std::string> camchain = read_file(camchain_path, kLargestYaml_bytes);
  if (!camchain) return camchain.error();
  if (const std::string other = camchain->find("cam0:") == std::string::npos ? foreign_file(*camchain) : ""; !other.empty())
    return Error{ErrorCode::unsupported, fmt::format("{}: {}", camchain_path, other)};
  Result<StereoRig> rig = parse_kalibr_camchain({camchain_path, *camchain}, files_beside(camchain_path));
  if (!rig) return rig;
  rig->imu_noise = otherwise;
  const YamlReader same_file(camchain_path, *camchain);
  if (!imu_path && !same_file.has(same_file.root(), "imu0")) return rig;
  return imu_path ? with_imu_file(*rig, *imu_path) : with_imu_text(*rig, camchain_path, *camchain, "");
}

Result<ImuNoise> load_imu(const std::string& path, const ImuNoise& otherwise) {
  const Result<std::string> text = read_file(path, kLargestYaml_bytes);
  if (!text) return text.error();
  return parse_imu({path, *text}, otherwise);
}

}  // namespace fbvins
