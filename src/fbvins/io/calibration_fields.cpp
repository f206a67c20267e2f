// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/calibration_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/camera/opencv_lens.hpp"
#include "fbvins/geometry/svd3.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/imu_axes_fields.hpp"

namespace fbvins {
namespace {

int read_side(YamlReader& yaml, const YAML::Node& map, double value) {
  if (value >= 1 && value <= kLargestImageSide_px && value == std::floor(value)) return static_cast<int>(value);
  yaml.complain(map, "resolution", fmt::format("{} is not a number of pixels", value));
  return 1;
}

/// Four coefficients of Brown's distortion behind a mirror; complains about other lengths, unless all after the fourth are zero.
std::vector<double> read_coefficients(YamlReader& yaml, const YAML::Node& map, const std::string& field) {
  std::vector<double> k = yaml.numbers(map, field);
  if (k.size() != 4 && !(k.size() > 4 && std::all_of(k.begin() + 4, k.end(), [](double x) { return x == 0; })))
    yaml.complain(map, field, fmt::format("has {} numbers where 4 are needed", k.size()));
  k.resize(4, 0.0);
  return k;
}

/// How many numbers Kalibr writes before fu, fv, pu, pv: ds xi, alpha; eucm alpha, beta; omni xi. None of an unknown model.
std::optional<std::size_t> numbers_before_focal(const std::string& model) {
  if (model == "pinhole") return 0;
  if (model == "omni") return 1;
  if (model == "ds" || model == "eucm") return 2;
  return std::nullopt;
}

/// What is wrong with the intrinsics of a camera that no lens has; empty where they are plausible.
std::string implausible_focal_length(const Camera& camera) {
  constexpr double kFewestWidths = 0.05, kMostWidths = 20;  // in widths of the image: the widest fisheye, a telescope
  const auto [fx, fy, cx, cy] = camera.intrinsics();
  const double width = camera.width();
  if (std::min(fx, fy) >= kFewestWidths * width && std::max(fx, fy) <= kMostWidths * width) return "";
  return fmt::format(
      "focal lengths of {:g} and {:g} px are none of images of {} x {}: are they in millimetres, or a share of the "
      "image's size?",
      fx, fy, camera.width(), camera.height());
}

/// The same of its principal point.
std::string implausible_centre(const Camera& camera) {
  const auto [fx, fy, cx, cy] = camera.intrinsics();
  const double x = 2 * cx / camera.width(), y = 2 * cy / camera.height();  // 1 in the middle
  if (std::abs(x - 1) <= 1.0 / 3 && std::abs(y - 1) <= 1.0 / 3) return "";
  const auto both_near = [&](double factor) { return std::abs(x / factor - 1) < 0.15 && std::abs(y / factor - 1) < 0.15; };
  return fmt::format("the principal point ({:g}, {:g}) lies outside the middle third of an image of {} x {}{}", cx, cy,
                     camera.width(), camera.height(),
                     both_near(2)     ? ": is the calibration that of images twice as large?"
                     : both_near(0.5) ? ": is the calibration that of images half as large?"
                                      : "");
}

/// The same of its distortion: it enlarges the image's edges by more than any lens, or has no rays half way to an edge.
std::string implausible_distortion(const Camera& camera) {
  constexpr double kMostEnlarged = 2;
  const auto [fx, fy, cx, cy] = camera.intrinsics();
  const Vec2 centre(cx, cy);
  for (const Vec2& edge : {Vec2(0, cy), Vec2(camera.width() - 1, cy), Vec2(cx, 0), Vec2(cx, camera.height() - 1)}) {
    if (!camera.undistort(0.5 * (centre + edge))) return "no ray belongs to pixels half way to the image's edge";
    const auto ray = camera.undistort(edge);
    const double seen = Vec2((edge.x() - cx) / fx, (edge.y() - cy) / fy).norm();
    if (ray && seen > kMostEnlarged * ray->norm())
      return fmt::format("the image's edge is enlarged {:.1f} times, which no lens does", seen / ray->norm());
  }
  return "";
}

}  // namespace

std::string yaml_list(const std::vector<double>& values) {
  std::string out;
  for (const double value : values) out += fmt::format("{}{:.17g}", out.empty() ? "" : ", ", value);  // 17 digits lose nothing
  return "[" + out + "]";
}

RigidTransform read_rigid_transform(YamlReader& yaml, const YAML::Node& map, const std::string& field) {
  const std::vector<double> m = yaml.numbers(map, field, 16);
  if (!yaml.ok()) return {};
  Mat3 R;
  R << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  // Hand-typed matrices carry three or four digits.
  constexpr double kTolerance = 3e-3, kExact = 1e-3;
  const double off = (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (!(off < kTolerance))
    yaml.complain(map, field,
                  fmt::format("its 3x3 part is not a rotation: its columns are not of length 1 and "
                              "orthogonal by up to {:.2g}",
                              off));
  else if (!(R.determinant() > 0)) yaml.complain(map, field, "its 3x3 part is not a rotation, but mirrors");
  else if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1) yaml.complain(map, field, "its last row is not 0 0 0 1");
  const Vec3 p(m[3], m[7], m[11]);
  if (!(p.cwiseAbs().maxCoeff() < 1e3)) yaml.complain(map, field, "its translation is more than a kilometre");
  if (!yaml.ok()) return {};
  if (off < kExact) return {Quat(R).normalized(), p};
  const Svd3 svd = svd3(R);  // the nearest rotation
  return {Quat(Mat3(svd.U * svd.V.transpose())).normalized(), p};
}

Camera read_camera(YamlReader& yaml, const YAML::Node& map, const std::string& coefficients_field, const ReadBeside& read) {
  const std::string model = yaml.word(map, "camera_model");
  const std::optional<std::size_t> before = numbers_before_focal(model);
  if (!before) {
    yaml.complain(map, "camera_model", fmt::format("'{}' is not supported, only pinhole, ds, eucm and omni", model));
    return {};
  }
  std::vector<double> own = yaml.numbers(map, "intrinsics", *before + 4);
  const std::vector<double> f(own.end() - 4, own.end());
  own.resize(*before);
  if (!(f[0] > 0 && f[1] > 0)) yaml.complain(map, "intrinsics", "the focal lengths are not positive");
  const std::vector<double> size = yaml.numbers(map, "resolution", 2);
  const int width = read_side(yaml, map, size[0]), height = read_side(yaml, map, size[1]);
  const std::string distortion = yaml.word(map, "distortion_model");
  const DistortionKind kind = distortion_kind(distortion);
  const bool none = kind == DistortionKind::none, equidistant = kind == DistortionKind::equidistant;
  const bool known =
      none || (kind == DistortionKind::brown && (model == "pinhole" || model == "omni")) || (equidistant && model == "pinhole");
  if (!known)
    yaml.complain(map, "distortion_model",
                  fmt::format("'{}' is not supported, only {}", distortion,
                              model == "pinhole" ? "radtan (plumb_bob, rational_polynomial), equidistant (fisheye) and none"
                              : model == "omni"  ? "radtan and none"
                                                 : "none"));
  if (model == "pinhole" && known && yaml.ok()) {
    const std::vector<double> k = none ? std::vector<double>{} : yaml.numbers(map, coefficients_field);
    const std::array<double, 4> focal{f[0], f[1], f[2], f[3]};
    Result<Camera> camera = equidistant ? fisheye_camera(focal, k, width, height) : opencv_camera(focal, k, width, height);
    if (yaml.ok() && !camera) yaml.complain(map, coefficients_field, camera.error().message);
    if (!yaml.ok()) return {};
    camera->set_mask(read_mask(yaml, map, *camera, read));
    return *camera;
  }
  const std::vector<double> k =
      none || !yaml.ok() ? std::vector<double>(4, 0.0) : read_coefficients(yaml, map, coefficients_field);
  if (const std::string problem = yaml.ok() ? outside_of_model(model, own) : ""; !problem.empty())
    yaml.complain(map, "intrinsics", problem);
  if (!yaml.ok()) return {};
  own.insert(own.end(), model == "omni" ? k.begin() : k.end(), k.end());
  Camera camera(*lens_of(model == "omni" ? "omni-radtan" : model, {f[0], f[1], f[2], f[3]}, own), width, height);
  camera.set_mask(read_mask(yaml, map, camera, read));
  return camera;
}

CameraTimes read_camera_times(YamlReader& yaml, const YAML::Node& map, double offset_of_first_s) {
  CameraTimes out{.time_offset_s = offset_of_first_s};
  if (yaml.has(map, "timeshift_cam_imu")) out.time_offset_s = yaml.number(map, "timeshift_cam_imu");
  if (std::abs(out.time_offset_s) > 10)
    yaml.complain(map, "timeshift_cam_imu", fmt::format("{} s is more than 10 s", out.time_offset_s));
  if (yaml.has(map, "line_delay")) out.line_delay_s = yaml.number(map, "line_delay");
  return out;
}

Camera read_real_camera(YamlReader& yaml, const YAML::Node& map, const std::string& coefficients_field, const ReadBeside& read) {
  Camera camera = read_camera(yaml, map, coefficients_field, read);
  if (!yaml.ok()) return camera;
  if (const std::string focal = implausible_focal_length(camera); !focal.empty()) yaml.complain(map, "intrinsics", focal);
  else if (const std::string problem = implausible_centre(camera); !problem.empty()) yaml.complain(map, "intrinsics", problem);
  else if (const std::string distorted = implausible_distortion(camera); !distorted.empty())
    yaml.complain(map, coefficients_field, distorted);
  return camera;
}

DepthSensor read_depth_sensor(YamlReader& yaml, const YAML::Node& map) {
  DepthSensor sensor;
  const auto take = [&](const char* key, double& value) {
    if (yaml.has(map, key)) value = yaml.positive(map, key);
  };
  take("noise_at_1m_m", sensor.noise_at_1m_m);
  take("nearest_m", sensor.nearest_m);
  take("farthest_m", sensor.farthest_m);
  take("scale_sigma", sensor.scale_sigma);
  return sensor;
}

std::string depth_sensor_text(const DepthSensor& sensor, const std::string& indent) {
  return fmt::format("{0}noise_at_1m_m: {1}\n{0}nearest_m: {2}\n{0}farthest_m: {3}\n{0}scale_sigma: {4}\n", indent,
                     sensor.noise_at_1m_m, sensor.nearest_m, sensor.farthest_m, sensor.scale_sigma);
}

ImuNoise read_imu_noise(YamlReader& yaml, const YAML::Node& map, const std::string& rate_field) {
  ImuNoise noise;
  noise.gyro_noise_density_radps_rthz = yaml.positive(map, "gyroscope_noise_density");
  noise.gyro_random_walk_radps2_rthz = yaml.positive(map, "gyroscope_random_walk");
  noise.accel_noise_density_mps2_rthz = yaml.positive(map, "accelerometer_noise_density");
  noise.accel_random_walk_mps3_rthz = yaml.positive(map, "accelerometer_random_walk");
  noise.rate_hz = yaml.positive(map, rate_field);
  if (yaml.has(map, "gyroscope_range")) noise.max_gyro_radps = yaml.positive(map, "gyroscope_range");
  if (yaml.has(map, "accelerometer_range")) noise.max_accel_mps2 = yaml.positive(map, "accelerometer_range");
  noise.axes = read_imu_axes(yaml, map);
  return noise;
}

std::string imu_noise_text(const ImuNoise& noise, const std::string& indent, fmt::string_view number) {
  std::string out;
  for (const auto& [field, value] : {std::pair("gyroscope_noise_density", noise.gyro_noise_density_radps_rthz),
                                     {"gyroscope_random_walk", noise.gyro_random_walk_radps2_rthz},
                                     {"accelerometer_noise_density", noise.accel_noise_density_mps2_rthz},
                                     {"accelerometer_random_walk", noise.accel_random_walk_mps3_rthz}})
    out += indent + field + ": " + fmt::vformat(number, fmt::make_format_args(value)) + "\n";
  return out;
}

}  // namespace fbvins
