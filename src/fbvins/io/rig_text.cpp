// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/rig_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/imu_axes_fields.hpp"

namespace fbvins {
namespace {

// Of a camera, beyond the rig's: so the sum is the same to the last bit.
constexpr const char* kTopics = "image_topics";
constexpr const char *kMoreOffset = "more_time_offset_s", *kMoreDelay = "more_line_delay_s";

std::string own_times_text(const Camera& camera) {
  std::string out;
  const auto [time_offset_s, line_delay_s] = camera.own_times();
  if (time_offset_s != 0) out += fmt::format("  {}: {:.17g}\n", kMoreOffset, time_offset_s);
  if (line_delay_s != 0) out += fmt::format("  {}: {:.17g}\n", kMoreDelay, line_delay_s);
  return out;
}

std::string camera_text(const std::string& name, const Camera& camera) {
  const KalibrCamera c = kalibr_camera(camera);
  return fmt::format(
      "{}:\n  camera_model: {}\n  resolution: [{}, {}]\n  intrinsics: {}\n  distortion_model: {}\n"
      "  distortion_coefficients: {}\n{}{}",
      name, c.model, camera.width(), camera.height(), yaml_list(c.intrinsics), c.distortion, yaml_list(c.coefficients),
      own_times_text(camera), mask_text(camera, "  "));
}

Camera read_exact_camera(YamlReader& yaml, const std::string& name) {
  const YAML::Node map = yaml.get(yaml.root(), name);
  Camera camera = read_camera(yaml, map, "distortion_coefficients");
  const auto number = [&](const char* field) { return yaml.has(map, field) ? yaml.number(map, field) : 0.0; };
  camera.set_own_times({number(kMoreOffset), number(kMoreDelay)});
  return camera;
}

template <class To, class From>
std::string pose_text(const std::string& name, const Pose<To, From>& T) {
  return fmt::format("{}:\n  q_wxyz: {}\n  p_m: {}\n", name, yaml_list({T.q.w(), T.q.x(), T.q.y(), T.q.z()}),
                     yaml_list({T.p.x(), T.p.y(), T.p.z()}));
}

template <class To, class From>
Pose<To, From> read_pose(YamlReader& yaml, const std::string& name) {
  const YAML::Node map = yaml.get(yaml.root(), name);
  const std::vector<double> q = yaml.numbers(map, "q_wxyz", 4), p = yaml.numbers(map, "p_m", 3);
  Pose<To, From> T;
  T.q = Quat(q[0], q[1], q[2], q[3]);  // as it is: normalising would change its last bits
  T.p = Vec3(p[0], p[1], p[2]);
  if (!(std::abs(T.q.norm() - 1) < 1e-9)) yaml.complain(map, "q_wxyz", "is not a rotation");
  if (!(T.p.cwiseAbs().maxCoeff() < 1e3)) yaml.complain(map, "p_m", "is more than a kilometre");
  return T;
}

std::string name_of(int camera) { return camera == 0 ? "left" : camera == 1 ? "right" : fmt::format("camera{}", camera); }

std::string pose_name(int camera) { return fmt::format("T_BC{}", camera); }

/// Of the first two all lenses come before the poses.
std::string cameras_text(const StereoRig& rig) {
  std::string lenses, poses, further;
  for (int i = 0; i < rig.camera_count(); ++i) {
    (i < 2 ? lenses : further) += camera_text(name_of(i), rig.camera(i));
    (i < 2 ? poses : further) += pose_text(pose_name(i), rig.T_BC(i));
  }
  return lenses + poses + further;
}

std::vector<MountedCamera> read_cameras(YamlReader& yaml) {
  std::vector<MountedCamera> out;
  for (int i = 0; i < kMostCameras && (i == 0 || yaml.has(yaml.root(), name_of(i))); ++i)
    out.push_back({read_exact_camera(yaml, name_of(i)), read_pose<B, C0>(yaml, pose_name(i))});
  return out;
}

}  // namespace

std::string with_topics(const std::string& text, const std::vector<std::string>& topics) {
  return topics.empty() ? text : fmt::format("{}: [\"{}\"]\n{}", kTopics, fmt::join(topics, "\", \""), text);
}

std::vector<std::string> topics_in(const std::string& text) {
  YamlReader yaml(std::string(kRigTopic), text);
  return yaml.texts(yaml.root(), kTopics);
}

std::string rig_to_yaml(const StereoRig& rig, const std::vector<std::string>& topics) {
  const ImuNoise& n = rig.imu_noise;
  const std::string text =
      "# The rig, every number exact. T_BC takes camera to body (IMU) coordinates, quaternions are Hamilton's with w first;\n"
      "# pixels, metres, seconds, radians; the IMU's stamp is the image's plus time_offset_s.\n" +
      cameras_text(rig) + fmt::format("imu:\n  rate_hz: {:.17g}\n", n.rate_hz) + imu_noise_text(n, "  ", "{:.17g}") +
      fmt::format("  gyroscope_range: {:.17g}\n  accelerometer_range: {:.17g}\n", n.max_gyro_radps, n.max_accel_mps2) +
      imu_axes_text(n.axes, "  ", true) +
      fmt::format("image_rate_hz: {:.17g}\ntime_offset_s: {:.17g}\n", rig.image_rate_hz, rig.time_offset_s) +
      (rig.line_delay_s == 0 ? "" : fmt::format("line_delay_s: {:.17g}\n", rig.line_delay_s)) +
      (rig.depth ? "depth:\n" + depth_sensor_text(*rig.depth, "  ") : "") +
      (rig.depth && rig.depth->own ? camera_text("depth_camera", rig.depth->own->camera) + pose_text("T_BD", rig.depth->own->T_BC)
                                   : "");
  return with_topics(text, topics);
}

Result<StereoRig> parse_rig(const std::string& text, const std::string& file) {
  YamlReader yaml(file, text);
  StereoRig rig;
  rig.cameras = read_cameras(yaml);
  rig.imu_noise = read_imu_noise(yaml, yaml.get(yaml.root(), "imu"), "rate_hz");
  rig.image_rate_hz = yaml.positive(yaml.root(), "image_rate_hz");
  rig.time_offset_s = yaml.number(yaml.root(), "time_offset_s");
  if (yaml.has(yaml.root(), "line_delay_s")) rig.line_delay_s = yaml.number(yaml.root(), "line_delay_s");
  if (yaml.has(yaml.root(), "depth")) {
    DepthSensor sensor = read_depth_sensor(yaml, yaml.get(yaml.root(), "depth"));
    if (yaml.has(yaml.root(), "depth_camera"))
      sensor.own = MountedCamera{read_exact_camera(yaml, "depth_camera"), read_pose<B, C0>(yaml, "T_BD")};
    rig = with_depth(rig, sensor);
  }
  if (!yaml.ok()) return yaml.error();
  if (Result<void> good = check_rig(rig, file); !good) return good.error();
  return rig;
}

}  // namespace fbvins
