// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/calibration.hpp"

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/io/calibration_fields.hpp"

namespace fbvins {

Result<CameraSensor> parse_euroc_camera(YamlReader yaml, const ReadBeside& read) {
  CameraSensor sensor;
  // EuRoC nests the 16 numbers under T_BS: data; other writers put them directly under T_BS.
  sensor.camera = read_real_camera(yaml, yaml.root(), "distortion_coefficients", read);
  sensor.rate_hz = yaml.positive(yaml.root(), "rate_hz");
  if (yaml.has(yaml.root(), "timeshift_cam_imu")) sensor.time_offset_s = yaml.number(yaml.root(), "timeshift_cam_imu");
  if (yaml.has(yaml.root(), "line_delay_us")) sensor.line_delay_s = 1e-6 * yaml.number(yaml.root(), "line_delay_us");
  if (!yaml.ok()) return yaml.error();
  Result<Pose<B, B>> mounting = parse_euroc_mounting(std::move(yaml));
  if (!mounting) return mounting.error();
  sensor.T_BS = mounting->cast_frames<B, C0>();
  return sensor;
}

Result<DepthSensor> parse_depth_sensor(YamlReader yaml, const Pose<B, B>& T_BI) {
  DepthSensor sensor = read_depth_sensor(yaml, yaml.root());
  if (!yaml.ok()) return yaml.error();
  const auto has = [&](const char* key) { return yaml.has(yaml.root(), key); };
  if (!has("T_BS") && !has("camera_model") && !has("intrinsics")) return sensor;
  sensor.own = MountedCamera{read_real_camera(yaml, yaml.root(), "distortion_coefficients", {}), {}};
  if (!yaml.ok()) return yaml.error();
  const Result<Pose<B, B>> mounting = parse_euroc_mounting(std::move(yaml));
  if (!mounting) return mounting.error();
  sensor.own->T_BC = (T_BI.inverse() * *mounting).cast_frames<B, C0>();
  return sensor;
}

Result<ImuSensor> parse_euroc_imu(YamlReader yaml) {
  ImuSensor sensor;
  sensor.noise = read_imu_noise(yaml, yaml.root(), "rate_hz");
  if (!yaml.ok()) return yaml.error();
  if (!yaml.has(yaml.root(), "T_BS")) return sensor;
  Result<Pose<B, B>> mounting = parse_euroc_mounting(std::move(yaml));
  if (!mounting) return mounting.error();
  sensor.T_BS = *mounting;
  return sensor;
}

Result<Pose<B, B>> parse_euroc_mounting(YamlReader yaml) {
  const YAML::Node T_BS = yaml.get(yaml.root(), "T_BS");
  const Pose<B, B> pose =
      yaml.has(T_BS, "data") ? read_transform<B, B>(yaml, T_BS, "data") : read_transform<B, B>(yaml, yaml.root(), "T_BS");
  if (!yaml.ok()) return yaml.error();
  return pose;
}

Result<StereoRig> join_euroc(const std::vector<CameraSensor>& cameras, const ImuSensor& imu, const std::string& file) {
  std::vector<MountedCamera> mounted;
  for (const CameraSensor& camera : cameras) mounted.push_back({camera.camera, imu.T_BS.inverse() * camera.T_BS});
  const CameraSensor& left = cameras.front();
  std::vector<CameraTimes> times;
  for (const CameraSensor& camera : cameras)
    times.push_back({camera.time_offset_s.value_or(left.time_offset_s.value_or(0)), camera.line_delay_s});
  StereoRig rig = with_times(with_cameras({}, mounted), times);
  rig.imu_noise = imu.noise;
  rig.image_rate_hz = left.rate_hz;
  if (Result<void> good = check_rig(rig, file); !good) return good.error();
  return rig;
}

}  // namespace fbvins
