// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/calibration_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/io/image_decode.hpp"

namespace fbvins {
namespace {

int read_side(YamlReader& yaml, const YAML::Node& map, double value) {
  if (value >= 1 && value <= kLargestImageSide_px && value == std::floor(value)) return static_cast<int>(value);
  yaml.complain(map, "resolution", fmt::format("{} is not a number of pixels", value));
  return 1;
}

/// Complains about lists that are too long, unless what is too much is zero; pads short ones with zeros.
std::vector<double> read_coefficients(YamlReader& yaml, const YAML::Node& map, const std::string& field) {
  std::vector<double> k = yaml.numbers(map, field);
  if (k.size() != 4 && !(k.size() > 4 && std::all_of(k.begin() + 4, k.end(), [](double x) { return x == 0; })))
    yaml.complain(map, field, fmt::format("has {} numbers where 4 are needed", k.size()));
  k.resize(4, 0.0);
  return k;
}

}  // namespace

RigidTransform read_rigid_transform(YamlReader& yaml, const YAML::Node& map, const std::string& field) {
  const std::vector<double> m = yaml.numbers(map, field, 16);
  if (!yaml.ok()) return {};
  Mat3 R;
  R << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  // Hand-typed matrices carry three or four digits.
  constexpr double kTolerance = 1e-3;
  if (!((R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() < kTolerance) || !(R.determinant() > 0))
    yaml.complain(map, field, "its 3x3 part is not a rotation");
  else if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1) yaml.complain(map, field, "its last row is not 0 0 0 1");
  const Vec3 p(m[3], m[7], m[11]);
  if (!(p.cwiseAbs().maxCoeff() < 1e3)) yaml.complain(map, field, "its translation is more than a kilometre");
  if (!yaml.ok()) return {};
  return {Quat(R).normalized(), p};
}

Camera read_camera(YamlReader& yaml, const YAML::Node& map, const std::string& coefficients_field) {
  if (const std::string model = yaml.word(map, "camera_model"); yaml.ok() && model != "pinhole")
    yaml.complain(map, "camera_model", fmt::format("'{}' is not supported, only pinhole", model));
  const std::vector<double> f = yaml.numbers(map, "intrinsics", 4);
  if (!(f[0] > 0 && f[1] > 0)) yaml.complain(map, "intrinsics", "the focal lengths are not positive");
  const std::vector<double> size = yaml.numbers(map, "resolution", 2);
  const int width = read_side(yaml, map, size[0]), height = read_side(yaml, map, size[1]);
  const std::string distortion = yaml.word(map, "distortion_model");
  if (distortion == "none") return {PinholeRadtan{f[0], f[1], f[2], f[3]}, width, height};
  const std::vector<double> k = read_coefficients(yaml, map, coefficients_field);
  const bool radtan = distortion == "radial-tangential" || distortion == "radtan";
  if (!radtan && distortion != "equidistant")
    yaml.complain(map, "distortion_model",
                  fmt::format("'{}' is not supported, only radial-tangential, radtan, equidistant and none", distortion));
  if (!yaml.ok()) return {};
  if (radtan) return {PinholeRadtan{f[0], f[1], f[2], f[3], k[0], k[1], k[2], k[3]}, width, height};
  return {KannalaBrandt{f[0], f[1], f[2], f[3], k[0], k[1], k[2], k[3]}, width, height};
}

ImuNoise read_imu_noise(YamlReader& yaml, const YAML::Node& map, const std::string& rate_field) {
  ImuNoise noise;
  noise.gyro_noise_density_radps_rthz = yaml.positive(map, "gyroscope_noise_density");
  noise.gyro_random_walk_radps2_rthz = yaml.positive(map, "gyroscope_random_walk");
  noise.accel_noise_density_mps2_rthz = yaml.positive(map, "accelerometer_noise_density");
  noise.accel_random_walk_mps3_rthz = yaml.positive(map, "accelerometer_random_walk");
  noise.rate_hz = yaml.positive(map, rate_field);
  return noise;
}

Result<void> check_baseline(const StereoRig& rig, const std::string& file) {
  const double baseline_m = rig.T_C1C0().p.norm();
  if (baseline_m > 1e-3 && baseline_m < 10.0) return {};
  return Error{ErrorCode::malformed,
               fmt::format("{}: the two cameras are {:.3g} m apart, not between 1 mm and 10 m", file, baseline_m)};
}

}  // namespace fbvins
