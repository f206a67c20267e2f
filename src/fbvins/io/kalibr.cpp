// SPDX-License-Identifier: Apache-2.0
// Kalibr's yaml formats: https://github.com/ethz-asl/kalibr/wiki/yaml-formats
#include "fbvins/io/kalibr.hpp"

#include <fmt/format.h>

#include <cmath>

#include "fbvins/io/calibration.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {
namespace {

/// T_CB of a camera: given directly, or through the one before.
Pose<C0, B> read_next_camera(YamlReader& yaml, const YAML::Node& camera, const Pose<C0, B>& T_before_B) {
  if (yaml.has(camera, "T_cam_imu")) return read_transform<C0, B>(yaml, camera, "T_cam_imu");
  return read_transform<C0, C0>(yaml, camera, "T_cn_cnm1") * T_before_B;
}

double read_time_offset_s(YamlReader& yaml, const YAML::Node& cam0, const YAML::Node& camera) {
  const auto read = [&](const YAML::Node& cam, double otherwise) {
    const double shift_s = yaml.has(cam, "timeshift_cam_imu") ? yaml.number(cam, "timeshift_cam_imu") : otherwise;
    if (std::abs(shift_s) > 10) yaml.complain(cam, "timeshift_cam_imu", fmt::format("{} s is more than 10 s", shift_s));
    return shift_s;
  };
  const double first_s = read(cam0, 0.0);
  const double this_s = read(camera, first_s);
  // One offset serves all cameras: they must be triggered together.
  if (std::abs(first_s - this_s) > 3e-3)
    yaml.complain(camera, "timeshift_cam_imu", fmt::format("differs from cam0's by {:.1f} ms", 1e3 * (this_s - first_s)));
  return first_s;
}

double read_line_delay_s(YamlReader& yaml, const YAML::Node& cam0, const YAML::Node& camera) {
  const auto read = [&](const YAML::Node& cam) { return yaml.has(cam, "line_delay") ? yaml.number(cam, "line_delay") : 0.0; };
  const double first_s = read(cam0);
  if (read(camera) != first_s) yaml.complain(camera, "line_delay", "differs from cam0's");
  return first_s;
}

}  // namespace

Result<StereoRig> parse_kalibr_camchain(YamlReader yaml, const ReadBeside& read) {
  const YAML::Node cam0 = yaml.get(yaml.root(), "cam0");
  if (!cam0.IsMap()) yaml.complain(yaml.root(), "cam0", "is missing or empty");
  Pose<C0, B> T_CB = read_transform<C0, B>(yaml, cam0, "T_cam_imu");
  std::vector<MountedCamera> cameras{{read_real_camera(yaml, cam0, "distortion_coeffs", read), T_CB.inverse()}};
  double time_offset_s = read_time_offset_s(yaml, cam0, cam0), line_delay_s = read_line_delay_s(yaml, cam0, cam0);
  for (int i = 1; yaml.get(yaml.root(), fmt::format("cam{}", i)).IsDefined(); ++i) {
    const std::string name = fmt::format("cam{}", i);
    const YAML::Node camera = yaml.get(yaml.root(), name);
    if (!camera.IsMap()) yaml.complain(yaml.root(), name, "is empty");
    if (!yaml.ok()) break;
    T_CB = read_next_camera(yaml, camera, T_CB);
    cameras.push_back({read_real_camera(yaml, camera, "distortion_coeffs", read), T_CB.inverse()});
    time_offset_s = read_time_offset_s(yaml, cam0, camera);
    line_delay_s = read_line_delay_s(yaml, cam0, camera);
  }
  StereoRig rig = with_cameras({}, cameras);
  rig.time_offset_s = time_offset_s;
  rig.line_delay_s = line_delay_s;
  if (!yaml.ok()) return yaml.error();
  if (Result<void> good = check_rig(rig, yaml.file()); !good) return good.error();
  return rig;
}

Result<ImuNoise> parse_kalibr_imu(YamlReader yaml) {
  const YAML::Node nested = yaml.get(yaml.root(), "imu0");
  const ImuNoise noise = read_imu_noise(yaml, nested.IsDefined() ? nested : yaml.root(), "update_rate");
  if (!yaml.ok()) return yaml.error();
  return noise;
}

Result<StereoRig> load_kalibr(const std::string& camchain_path, const std::optional<std::string>& imu_path,
                              const ImuNoise& otherwise) {
  Result<std::string> camchain = read_file(camchain_path, kLargestYaml_bytes);
  if (!camchain) return camchain.error();
  Result<StereoRig> rig = parse_kalibr_camchain({camchain_path, *camchain}, files_beside(camchain_path));
  if (!rig) return rig;
  rig->imu_noise = otherwise;
  const YamlReader same_file(camchain_path, *camchain);
  if (!imu_path && !same_file.has(same_file.root(), "imu0")) return rig;
  Result<std::string> imu = imu_path ? read_file(*imu_path, kLargestYaml_bytes) : *std::move(camchain);
  if (!imu) return imu.error();
  Result<ImuNoise> noise = parse_kalibr_imu({imu_path.value_or(camchain_path), *std::move(imu)});
  if (!noise) return noise.error();
  rig->imu_noise = *noise;
  return rig;
}

}  // namespace fbvins
