// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/imu_axes_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fbvins/camera/check_rig.hpp"

namespace fbvins {
namespace {

Mat3 matrix_of(const std::vector<double>& m) {
  Mat3 out;
  out << m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8];
  return out;
}

/// A 3x3 matrix, row by row; `otherwise` where it is not there.
Mat3 read_matrix(YamlReader& yaml, const YAML::Node& map, const char* field, const Mat3& otherwise) {
  return yaml.has(map, field) ? matrix_of(yaml.numbers(map, field, 9)) : otherwise;
}

Mat3 read_rotation(YamlReader& yaml, const YAML::Node& map, const char* field) {
  const Mat3 R = read_matrix(yaml, map, field, Mat3::Identity());
  // Hand-typed matrices carry three or four digits.
  if (yaml.ok() && (!((R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-3) || !(R.determinant() > 0)))
    yaml.complain(map, field, "is not a rotation");
  return R;
}

Vec3 read_vector(YamlReader& yaml, const YAML::Node& map, const char* field) {
  if (!yaml.has(map, field)) return Vec3::Zero();
  const std::vector<double> v = yaml.numbers(map, field, 3);
  return {v[0], v[1], v[2]};
}

/// Complains where they are none that an IMU has.
void check(YamlReader& yaml, const YAML::Node& map, const char* field, const ImuIntrinsics& axes) {
  if (!yaml.ok()) return;
  if (const Result<void> good = check_imu({.axes = axes}, ""); !good) yaml.complain(map, field, good.error().message.substr(2));
}

/// What a sensor reads that is corrected as M reading - b; complains where M has no inverse.
void set_reading(YamlReader& yaml, const YAML::Node& map, const char* field, const Mat3& M, const Vec3& b, Mat3& matrix,
                 Vec3& bias) {
  constexpr double kNoInverse = 1e-3;
  if (!yaml.ok()) return;
  if (!M.allFinite() || !(std::abs(M.determinant()) > kNoInverse))
    return yaml.complain(map, field, "is a matrix without an inverse");
  matrix = M.inverse();
  bias = matrix * b;
}

ImuIntrinsics read_kalibr(YamlReader& yaml, const YAML::Node& map) {
  ImuIntrinsics out;
  const YAML::Node gyro = yaml.get(map, "gyroscopes"), accel = yaml.get(map, "accelerometers");
  for (const char* field : {"gyroscopes", "accelerometers"})
    if (yaml.has(map, field) && !yaml.has(yaml.get(map, field), "M")) yaml.complain(map, field, "has no matrix M");
  const Mat3 C = read_rotation(yaml, gyro, "C_gyro_i");
  out.gyro = read_matrix(yaml, gyro, "M", out.gyro) * C;
  out.gyro_by_force = read_matrix(yaml, gyro, "A", out.gyro_by_force) * C;
  out.accel = read_matrix(yaml, accel, "M", out.accel);
  check(yaml, map, gyro.IsDefined() ? "gyroscopes" : "accelerometers", out);
  return out;
}

ImuIntrinsics read_openvins(YamlReader& yaml, const YAML::Node& map) {
  ImuIntrinsics out;
  out.gyro = read_matrix(yaml, map, "Tw", out.gyro) * read_rotation(yaml, map, "R_IMUtoGYRO");
  out.accel = read_matrix(yaml, map, "Ta", out.accel) * read_rotation(yaml, map, "R_IMUtoACC");
  out.gyro_by_force = read_matrix(yaml, map, "Tg", out.gyro_by_force);
  check(yaml, map, yaml.has(map, "Tw") ? "Tw" : "Ta", out);
  return out;
}

std::string matrix_text(const char* field, const Mat3& m, const std::string& indent) {
  std::string out = fmt::format("{}{}:\n", indent, field);
  for (int row = 0; row < 3; ++row) {
    out += indent + "- [";
    for (int column = 0; column < 3; ++column) {
      std::string number = fmt::format("{:.17g}", m(row, column));
      if (number.find_first_of(".en") == std::string::npos) number += ".0";  // Kalibr wants floating point numbers
      out += number + (column < 2 ? ", " : "]\n");
    }
  }
  return out;
}

std::string vector_text(const char* field, const Vec3& v, const std::string& indent) {
  return v.isZero(0) ? "" : fmt::format("{}{}: [{:.17g}, {:.17g}, {:.17g}]\n", indent, field, v.x(), v.y(), v.z());
}

/// The rotation of a matrix that is a lower triangular one, with a positive diagonal, times it.
Mat3 rotation_behind_triangle(const Mat3& m) {
  Mat3 C;
  C.row(0) = m.row(0).normalized();
  C.row(1) = (m.row(1) - m.row(1).dot(C.row(0)) * C.row(0)).normalized();
  C.row(2) = C.row(0).cross(C.row(1));
  return C;
}

}  // namespace

ImuIntrinsics read_imu_axes(YamlReader& yaml, const YAML::Node& map) {
  const auto has_any = [&](std::initializer_list<const char*> fields) {
    return std::any_of(fields.begin(), fields.end(), [&](const char* field) { return yaml.has(map, field); });
  };
  if (yaml.text(map, "model") == "scale-misalignment-size-effect" || yaml.has(yaml.get(map, "accelerometers"), "rx_i")) {
    yaml.complain(
        map, yaml.has(map, "model") ? "model" : "accelerometers",
        "scale-misalignment-size-effect gives each axis of the accelerometer a place of its own, which is not supported: "
        "calibrate with scale-misalignment");
    return {};
  }
  ImuIntrinsics out;
  if (has_any({"gyroscopes", "accelerometers"})) out = read_kalibr(yaml, map);
  else if (has_any({"Tw", "Ta", "Tg", "R_IMUtoGYRO", "R_IMUtoACC"})) out = read_openvins(yaml, map);
  out.bias = {read_vector(yaml, map, "gyroscope_bias"), read_vector(yaml, map, "accelerometer_bias")};
  check(yaml, map, yaml.has(map, "gyroscope_bias") ? "gyroscope_bias" : "accelerometer_bias", out);
  return yaml.ok() ? out : ImuIntrinsics{};
}

std::string imu_axes_text(const ImuIntrinsics& axes, const std::string& indent, bool exact) {
  if (axes == ImuIntrinsics{}) return "";
  const std::string inner = indent + "  ";
  const Mat3 C = exact ? Mat3(Mat3::Identity()) : rotation_behind_triangle(axes.gyro);
  Mat3 M = axes.gyro, A = axes.gyro_by_force;
  if (!exact) {
    M = axes.gyro * C.transpose(), A = axes.gyro_by_force * C.transpose();
    M(0, 1) = M(0, 2) = M(1, 2) = 0;  // to the last bit
  }
  return indent + "model: scale-misalignment\n" + indent + "accelerometers:\n" + matrix_text("M", axes.accel, inner) + indent +
         "gyroscopes:\n" + matrix_text("A", A, inner) + matrix_text("C_gyro_i", C, inner) + matrix_text("M", M, inner) +
         vector_text("gyroscope_bias", axes.bias.gyro_radps, indent) +
         vector_text("accelerometer_bias", axes.bias.accel_mps2, indent);
}

bool is_realsense_imu(const YamlReader& yaml) { return yaml.get(yaml.root(), "imus").IsSequence(); }

ImuIntrinsics read_realsense_imu(YamlReader& yaml) {
  ImuIntrinsics out;
  const YAML::Node list = yaml.get(yaml.root(), "imus");
  if (list.size() != 1 || !list[0].IsMap()) {
    yaml.complain(yaml.root(), "imus", fmt::format("has {} IMUs, not one", list.size()));
    return out;
  }
  const auto read = [&](const char* sensor, Mat3& matrix, Vec3& bias) {
    const YAML::Node map = yaml.get(list[0], sensor);
    if (!map.IsMap()) return yaml.complain(list[0], sensor, "is missing or empty");
    const Mat3 S = matrix_of(yaml.numbers(map, "scale_and_alignment", 9));
    set_reading(yaml, map, "scale_and_alignment", S, read_vector(yaml, map, "bias"), matrix, bias);
  };
  read("gyroscope", out.gyro, out.bias.gyro_radps);
  read("accelerometer", out.accel, out.bias.accel_mps2);
  check(yaml, yaml.root(), "imus", out);
  return yaml.ok() ? out : ImuIntrinsics{};
}

ImuIntrinsics read_basalt_axes(YamlReader& yaml, const YAML::Node& map) {
  ImuIntrinsics out;
  if (yaml.has(map, "calib_accel_bias")) {
    const std::vector<double> a = yaml.numbers(map, "calib_accel_bias", 9);
    Mat3 S = Mat3::Identity();
    S(0, 0) += a[3], S(1, 0) = a[4], S(2, 0) = a[5], S(1, 1) += a[6], S(2, 1) = a[7], S(2, 2) += a[8];
    set_reading(yaml, map, "calib_accel_bias", S, {a[0], a[1], a[2]}, out.accel, out.bias.accel_mps2);
  }
  if (yaml.has(map, "calib_gyro_bias")) {
    const std::vector<double> g = yaml.numbers(map, "calib_gyro_bias", 12);
    Mat3 S;  // column by column
    S << 1 + g[3], g[6], g[9], g[4], 1 + g[7], g[10], g[5], g[8], 1 + g[11];
    set_reading(yaml, map, "calib_gyro_bias", S, {g[0], g[1], g[2]}, out.gyro, out.bias.gyro_radps);
  }
  check(yaml, map, yaml.has(map, "calib_gyro_bias") ? "calib_gyro_bias" : "calib_accel_bias", out);
  return yaml.ok() ? out : ImuIntrinsics{};
}

}  // namespace fbvins
