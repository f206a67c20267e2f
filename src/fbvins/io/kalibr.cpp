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

/// T_C1B of the second camera: given directly, or through the first one.
Pose<C1, B> read_second_camera(YamlReader& yaml, const YAML::Node& cam1, const Pose<C0, B>& T_C0B) {
  if (yaml.has(cam1, "T_cam_imu")) return read_transform<C1, B>(yaml, cam1, "T_cam_imu");
  return read_transform<C1, C0>(yaml, cam1, "T_cn_cnm1") * T_C0B;
}

double read_time_offset_s(YamlReader& yaml, const YAML::Node& cam0, const YAML::Node& cam1) {
  const auto read = [&](const YAML::Node& cam, double otherwise) {
    const double shift_s = yaml.has(cam, "timeshift_cam_imu") ? yaml.number(cam, "timeshift_cam_imu") : otherwise;
    if (std::abs(shift_s) > 10) yaml.complain(cam, "timeshift_cam_imu", fmt::format("{} s is more than 10 s", shift_s));
    return shift_s;
  };
  const double left_s = read(cam0, 0.0);
  const double right_s = read(cam1, left_s);
  // One offset serves both cameras: they must be triggered together.
  if (std::abs(left_s - right_s) > 3e-3)
    yaml.complain(cam1, "timeshift_cam_imu", fmt::format("differs from cam0's by {:.1f} ms", 1e3 * (right_s - left_s)));
  return left_s;
}

double read_line_delay_s(YamlReader& yaml, const YAML::Node& cam0, const YAML::Node& cam1) {
  const auto read = [&](const YAML::Node& cam) { return yaml.has(cam, "line_delay") ? yaml.number(cam, "line_delay") : 0.0; };
  const double left_s = read(cam0);
  if (read(cam1) != left_s) yaml.complain(cam1, "line_delay", "differs from cam0's");
  return left_s;
}

}  // namespace

Result<StereoRig> parse_kalibr_camchain(YamlReader yaml) {
  const YAML::Node cam0 = yaml.get(yaml.root(), "cam0"), cam1 = yaml.get(yaml.root(), "cam1");
  const bool two = cam1.IsDefined();
  if (!cam0.IsMap()) yaml.complain(yaml.root(), "cam0", "is missing or empty");
  if (two && !cam1.IsMap()) yaml.complain(yaml.root(), "cam1", "is empty");
  StereoRig rig;
  rig.left = read_camera(yaml, cam0, "distortion_coeffs");
  const Pose<C0, B> T_C0B = read_transform<C0, B>(yaml, cam0, "T_cam_imu");
  rig.T_BC0 = T_C0B.inverse();
  rig.T_BC1 = rig.T_BC0.cast_frames<B, C1>();
  if (two) rig.right = read_camera(yaml, cam1, "distortion_coeffs");
  if (two) rig.T_BC1 = read_second_camera(yaml, cam1, T_C0B).inverse();
  rig.time_offset_s = read_time_offset_s(yaml, cam0, two ? cam1 : cam0);
  rig.line_delay_s = read_line_delay_s(yaml, cam0, two ? cam1 : cam0);
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

Result<StereoRig> load_kalibr(const std::string& camchain_path, const std::optional<std::string>& imu_path) {
  Result<std::string> camchain = read_file(camchain_path, kLargestYaml_bytes);
  if (!camchain) return camchain.error();
  Result<StereoRig> rig = parse_kalibr_camchain({camchain_path, *std::move(camchain)});
  if (!rig || !imu_path) return rig;
  Result<std::string> imu = read_file(*imu_path, kLargestYaml_bytes);
  if (!imu) return imu.error();
  Result<ImuNoise> noise = parse_kalibr_imu({*imu_path, *std::move(imu)});
  if (!noise) return noise.error();
  rig->imu_noise = *noise;
  return rig;
}

}  // namespace fbvins
