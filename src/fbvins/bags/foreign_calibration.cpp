// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/foreign_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/camera/opencv_lens.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/imu_axes_fields.hpp"

namespace fbvins {
namespace {

int side_px(YamlReader& yaml, const YAML::Node& map, const std::string& field) {
  return static_cast<int>(yaml.number_between(map, field, 1, kLargestImageSide_px, 1));
}

/// The map inside of a map; complains where there is none.
YAML::Node inner(YamlReader& yaml, const YAML::Node& map, const std::string& field) {
  const YAML::Node node = yaml.get(map, field);
  if (!node.IsMap()) yaml.complain(map, field, "is missing or empty");
  return node;
}

/// An element of a list of maps.
YAML::Node element(YamlReader& yaml, const YAML::Node& map, const std::string& field, std::size_t index) {
  const YAML::Node list = yaml.get(map, field);
  if (list.IsSequence() && index < list.size() && (list[index].IsMap() || list[index].IsSequence())) return list[index];
  yaml.complain(map, field, fmt::format("has no element {}", index));
  return YAML::Node(YAML::NodeType::Map);
}

Result<StereoRig> finished(const YamlReader& yaml, const StereoRig& rig) {
  if (!yaml.ok()) return yaml.error();
  if (Result<void> good = check_rig(rig, yaml.file()); !good) return good.error();
  return rig;
}

// OpenVINS

Pose<B, C0> mounting(YamlReader& yaml, const YAML::Node& camera) {
  if (yaml.has(camera, "T_cam_imu")) return read_transform<C0, B>(yaml, camera, "T_cam_imu").inverse();
  return read_transform<B, C0>(yaml, camera, "T_imu_cam");
}

// Basalt

Camera basalt_camera(YamlReader& yaml, const YAML::Node& root, std::size_t index) {
  const YAML::Node camera = element(yaml, root, "intrinsics", index);
  const YAML::Node size = element(yaml, root, "resolution", index);
  const std::string model = yaml.word(camera, "camera_type");
  const YAML::Node k = inner(yaml, camera, "intrinsics");
  const double fx = yaml.positive(k, "fx"), fy = yaml.positive(k, "fy"), cx = yaml.number(k, "cx"), cy = yaml.number(k, "cy");
  int sides[2] = {1, 1};
  for (std::size_t i = 0; i < 2 && size.IsSequence() && i < size.size(); ++i)
    sides[i] = std::clamp(size[i].as<int>(1), 1, kLargestImageSide_px);
  const auto number = [&](const char* name) { return yaml.number(k, name); };
  if (!yaml.ok()) return {};
  if (model == "kb4")
    return {KannalaBrandt{fx, fy, cx, cy, number("k1"), number("k2"), number("k3"), number("k4")}, sides[0], sides[1]};
  if (model == "pinhole") return {PinholeRadtan{fx, fy, cx, cy}, sides[0], sides[1]};
  if (model == "pinhole-radtan8") {
    std::vector<double> eight;
    for (const char* name : {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}) eight.push_back(number(name));
    const Result<Camera> lens = opencv_camera({fx, fy, cx, cy}, eight, sides[0], sides[1]);
    if (yaml.ok() && !lens) yaml.complain(k, "k1", lens.error().message);
    return yaml.ok() ? *lens : Camera();
  }
  if (model == "ds" || model == "eucm") {
    const std::vector<double> own =
        model == "ds" ? std::vector{number("xi"), number("alpha")} : std::vector{number("alpha"), number("beta")};
    if (const std::string problem = yaml.ok() ? outside_of_model(model, own) : ""; !problem.empty())
      yaml.complain(k, model == "ds" ? "xi" : "alpha", problem);
    if (!yaml.ok()) return {};
    return {*lens_of(model, {fx, fy, cx, cy}, own), sides[0], sides[1]};
  }
  yaml.complain(camera, "camera_type",
                fmt::format("'{}' is not supported, only pinhole, pinhole-radtan8, kb4, ds and eucm", model));
  return {};
}

Pose<B, C0> basalt_mounting(YamlReader& yaml, const YAML::Node& root, std::size_t index) {
  const YAML::Node T = element(yaml, root, "T_imu_cam", index);
  const Quat q(yaml.number(T, "qw"), yaml.number(T, "qx"), yaml.number(T, "qy"), yaml.number(T, "qz"));
  const Vec3 p(yaml.number(T, "px"), yaml.number(T, "py"), yaml.number(T, "pz"));
  if (yaml.ok() && !(std::abs(q.norm() - 1) < 1e-3)) yaml.complain(T, "qw", "this quaternion's norm is not 1");
  return yaml.ok() ? Pose<B, C0>(q.normalized(), p) : Pose<B, C0>();
}

/// The largest of three.
double worst_axis(YamlReader& yaml, const YAML::Node& map, const std::string& field) {
  const std::vector<double> axes = yaml.numbers(map, field, 3);
  const double worst = *std::max_element(axes.begin(), axes.end());
  if (yaml.ok() && !(worst > 0)) yaml.complain(map, field, "is not positive");
  return worst;
}

// VINS-Fusion

Camera camodocal_camera(YamlReader& yaml) {
  const YAML::Node& root = yaml.root();
  const int width = side_px(yaml, root, "image_width"), height = side_px(yaml, root, "image_height");
  const std::string model = yaml.word(root, "model_type");
  const YAML::Node p = inner(yaml, root, "projection_parameters");
  const auto number = [&](const YAML::Node& map, const char* name) { return yaml.number(map, name); };
  if (!yaml.ok()) return {};
  if (model == "PINHOLE") {
    const YAML::Node d = inner(yaml, root, "distortion_parameters");
    return {PinholeRadtan{yaml.positive(p, "fx"), yaml.positive(p, "fy"), number(p, "cx"), number(p, "cy"), number(d, "k1"),
                          number(d, "k2"), number(d, "p1"), number(d, "p2")},
            width, height};
  }
  if (model == "KANNALA_BRANDT")
    return {KannalaBrandt{yaml.positive(p, "mu"), yaml.positive(p, "mv"), number(p, "u0"), number(p, "v0"), number(p, "k2"),
                          number(p, "k3"), number(p, "k4"), number(p, "k5")},
            width, height};
  if (model == "MEI") {
    const YAML::Node d = inner(yaml, root, "distortion_parameters"), mirror = inner(yaml, root, "mirror_parameters");
    const double xi = number(mirror, "xi");
    if (const std::string problem = yaml.ok() ? outside_of_model("omni", {xi}) : ""; !problem.empty())
      yaml.complain(mirror, "xi", problem);
    return {UnifiedRadtan{yaml.positive(p, "gamma1"), yaml.positive(p, "gamma2"), number(p, "u0"), number(p, "v0"), xi,
                          number(d, "k1"), number(d, "k2"), number(d, "p1"), number(d, "p2")},
            width, height};
  }
  yaml.complain(root, "model_type", fmt::format("'{}' is not supported, only PINHOLE, KANNALA_BRANDT and MEI", model));
  return {};
}

/// Of single readings at 200 Hz.
ImuNoise vins_noise(YamlReader& yaml) {
  constexpr double kRate_hz = 200;
  const auto density = [&](const char* field) { return yaml.positive(yaml.root(), field) / std::sqrt(kRate_hz); };
  return {density("gyr_n"), density("acc_n"), density("gyr_w"), density("acc_w"), kRate_hz};
}

Pose<B, C0> body_T_cam(YamlReader& yaml, const std::string& field) {
  const YAML::Node T = inner(yaml, yaml.root(), field);
  return yaml.ok() ? read_transform<B, C0>(yaml, T, "data") : Pose<B, C0>();
}

// ROS

struct RosCamera {
  Camera camera;
  Mat3 rectification = Mat3::Identity();
  double shift_m = 0;  ///< of the rectified camera along x, as its projection has it
  std::array<double, 4> projection{};
};

RosCamera ros_camera(YamlReader& yaml) {
  const YAML::Node& root = yaml.root();
  const int width = side_px(yaml, root, "image_width"), height = side_px(yaml, root, "image_height");
  const std::vector<double> k = yaml.numbers(inner(yaml, root, "camera_matrix"), "data", 9),
                            R = yaml.numbers(inner(yaml, root, "rectification_matrix"), "data", 9),
                            P = yaml.numbers(inner(yaml, root, "projection_matrix"), "data", 12);
  std::vector<double> d = yaml.numbers(inner(yaml, root, "distortion_coefficients"), "data");
  const std::string model = yaml.word(root, "distortion_model");
  if (yaml.ok() && !(k[0] > 0 && k[4] > 0 && P[0] > 0))
    yaml.complain(root, "camera_matrix", "the focal lengths are not positive");
  const DistortionKind kind = distortion_kind(model);
  if (yaml.ok() && kind == DistortionKind::unknown)
    yaml.complain(root, "distortion_model",
                  fmt::format("'{}' is not supported, only plumb_bob, rational_polynomial and equidistant", model));
  if (!yaml.ok()) return {};
  const std::array<double, 4> f{k[0], k[4], k[2], k[5]};
  if (kind == DistortionKind::none) d.clear();
  const Result<Camera> camera =
      kind == DistortionKind::equidistant ? fisheye_camera(f, d, width, height) : opencv_camera(f, d, width, height);
  if (!camera) {
    yaml.complain(root, "distortion_coefficients", camera.error().message);
    return {};
  }
  RosCamera out;
  out.camera = *camera;
  out.rectification << R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8];
  out.shift_m = P[3] / P[0];
  out.projection = {P[0], P[5], P[2], P[6]};
  return out;
}

}  // namespace

Result<StereoRig> parse_openvins_cameras(YamlReader yaml, const ReadBeside& read) {
  std::vector<MountedCamera> cameras;
  std::vector<CameraTimes> times;
  for (int i = 0; yaml.ok() && (i == 0 || yaml.has(yaml.root(), fmt::format("cam{}", i))); ++i) {
    const YAML::Node camera = inner(yaml, yaml.root(), fmt::format("cam{}", i));
    if (!yaml.ok()) break;
    cameras.push_back({read_real_camera(yaml, camera, "distortion_coeffs", read), mounting(yaml, camera)});
    times.push_back(read_camera_times(yaml, camera, times.empty() ? 0 : times.front().time_offset_s));
  }
  if (!yaml.ok()) return yaml.error();
  return finished(yaml, with_times(with_cameras({}, cameras), times));
}

Result<StereoRig> parse_basalt(YamlReader yaml) {  // JSON is YAML
  const YAML::Node root = inner(yaml, yaml.root(), "value0");
  if (!yaml.ok()) return yaml.error();
  const YAML::Node lenses = yaml.get(root, "intrinsics");
  std::vector<MountedCamera> cameras;
  for (std::size_t i = 0; yaml.ok() && i < std::max<std::size_t>(1, lenses.IsSequence() ? lenses.size() : 0); ++i)
    cameras.push_back({basalt_camera(yaml, root, i), basalt_mounting(yaml, root, i)});
  if (!yaml.ok()) return yaml.error();
  StereoRig rig = with_cameras({}, cameras);
  rig.imu_noise.rate_hz = yaml.positive(root, "imu_update_rate");
  rig.imu_noise.gyro_noise_density_radps_rthz = worst_axis(yaml, root, "gyro_noise_std");
  rig.imu_noise.accel_noise_density_mps2_rthz = worst_axis(yaml, root, "accel_noise_std");
  rig.imu_noise.gyro_random_walk_radps2_rthz = worst_axis(yaml, root, "gyro_bias_std");
  rig.imu_noise.accel_random_walk_mps3_rthz = worst_axis(yaml, root, "accel_bias_std");
  rig.imu_noise.axes = read_basalt_axes(yaml, root);
  rig.time_offset_s = 1e-9 * yaml.number_between(root, "cam_time_offset_ns", -1e10, 1e10, 0);
  return finished(yaml, rig);
}

Result<StereoRig> parse_vins_mono(YamlReader yaml) {
  const YAML::Node& root = yaml.root();
  const Camera camera = camodocal_camera(yaml);
  if (yaml.ok() && !yaml.has(root, "extrinsicRotation"))
    yaml.complain(
        root, "extrinsicRotation",
        "is missing: the camera's place on the IMU is not given; take what VINS has estimated, or calibrate with `fbvins calibrate`");
  const std::vector<double> r = yaml.numbers(inner(yaml, root, "extrinsicRotation"), "data", 9),
                            p = yaml.numbers(inner(yaml, root, "extrinsicTranslation"), "data", 3);
  if (!yaml.ok()) return yaml.error();
  Mat3 R;
  R << r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8];
  if (const double off = (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff(); !(off < 3e-3) || !(R.determinant() > 0))
    yaml.complain(root, "extrinsicRotation",
                  fmt::format("is not a rotation: its columns are not of length 1 and orthogonal by up to {:.2g}", off));
  StereoRig rig = with_cameras({}, {{camera, Pose<B, C0>(Quat(R).normalized(), Vec3(p[0], p[1], p[2]))}});
  rig.imu_noise = vins_noise(yaml);
  rig.time_offset_s = yaml.number_between(root, "td", -10, 10, 0);
  if (yaml.number_between(root, "rolling_shutter", 0, 1, 0) == 1 && camera.height() > 0) {
    const double readout_s = yaml.number_between(root, "rolling_shutter_tr", 0, 0.2, 0);
    rig.line_delay_s = readout_s / camera.height();
    rig.time_offset_s += 0.5 * readout_s;  // ours is the middle row's
  }
  return finished(yaml, rig);
}

Result<StereoRig> parse_vins_fusion(YamlReader yaml, std::vector<YamlReader> files) {
  std::vector<MountedCamera> cameras;
  for (YamlReader& file : files) {
    const Camera camera = camodocal_camera(file);
    if (!file.ok()) return file.error();
    cameras.push_back({camera, body_T_cam(yaml, fmt::format("body_T_cam{}", cameras.size()))});
  }
  if (!yaml.ok()) return yaml.error();
  StereoRig rig = with_cameras({}, cameras);
  rig.imu_noise = vins_noise(yaml);
  rig.time_offset_s = yaml.number_between(yaml.root(), "td", -10, 10, 0);
  return finished(yaml, rig);
}

Error camera_info_alone(YamlReader yaml) {
  const RosCamera ros = ros_camera(yaml);
  if (!yaml.ok()) return yaml.error();
  const KalibrCamera k = kalibr_camera(ros.camera);
  return {ErrorCode::unsupported,
          fmt::format(
              "{}: this is a camera_info file of ROS, without the camera's place on the IMU: write it as Kalibr's chain, with "
              "T_cam_imu beside camera_model: {}, intrinsics: {}, distortion_model: {}, distortion_coeffs: {}, resolution: "
              "[{}, {}]",
              yaml.file(), k.model, yaml_list(k.intrinsics), k.distortion, yaml_list(k.coefficients), ros.camera.width(),
              ros.camera.height())};
}

Result<BagCamera> parse_camera_info_file(YamlReader yaml) {
  const RosCamera ros = ros_camera(yaml);
  if (!yaml.ok()) return yaml.error();
  const auto [fx, fy, cx, cy] = ros.projection;
  const bool rotates = (ros.rectification.transpose() * ros.rectification - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-3;
  BagCamera out{ros.camera, ""};
  if (rotates && fx > 0 && fy > 0)
    out.rectified = {Camera(PinholeRadtan{fx, fy, cx, cy}, ros.camera.width(), ros.camera.height()), ros.rectification,
                     -ros.shift_m};
  return out;
}

Result<StereoRig> parse_kimera(std::vector<YamlReader> files, std::optional<YamlReader> imu_file) {
  std::vector<CameraSensor> cameras;
  for (YamlReader& file : files) {
    const Result<CameraSensor> camera = parse_euroc_camera(file);
    if (!camera) return camera.error();
    cameras.push_back(*camera);
  }
  ImuSensor imu;
  if (imu_file) {
    const Result<ImuSensor> read = parse_euroc_imu(*imu_file);
    if (!read) return read.error();
    imu = *read;
    // To be added to the IMU's stamps.
    const double shift_s = imu_file->number_between(imu_file->root(), "imu_time_shift", -10, 10, 0);
    if (!imu_file->ok()) return imu_file->error();
    for (CameraSensor& camera : cameras) camera.time_offset_s = -shift_s;
  }
  return join_euroc(cameras, imu, files.front().file());
}

Result<StereoRig> parse_camera_info(YamlReader left, YamlReader right, const Pose<B, C0>& T_BC0) {
  const RosCamera c0 = ros_camera(left), c1 = ros_camera(right);
  if (!left.ok()) return left.error();
  if (!right.ok()) return right.error();
  // p_C1 = R1^T (R0 p_C0 + shift): rectified frames differ by a shift along x alone.
  const Vec3 shift(c1.shift_m - c0.shift_m, 0, 0);
  const Pose<C1, C0> T_C1C0(Mat3(c1.rectification.transpose() * c0.rectification), Vec3(c1.rectification.transpose() * shift));
  const Pose<B, C1> T_BC1 = T_BC0 * T_C1C0.inverse();
  return finished(right, with_cameras({}, {{c0.camera, T_BC0}, {c1.camera, T_BC1.cast_frames<B, C0>()}}));
}

}  // namespace fbvins
