// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/imu_state_file.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>

#include "fbvins/core/atomic_file.hpp"
#include "fbvins/core/byte_source.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/imu_axes_fields.hpp"

namespace fbvins {
namespace {

/// Largest plausible biases at the start of a flight.
constexpr double kLargestGyroBias_radps = 1;
constexpr double kLargestAccelBias_mps2 = 5;
constexpr double kLargestTimeOffset_s = 5;  // as of a calibration

std::string list(const double* values, int count) {
  std::string out;
  for (int i = 0; i < count; ++i) out += fmt::format("{}{:.17g}", i == 0 ? "[" : ", ", values[i]);
  return out + "]";
}

std::string upper(const Mat3& m) {
  const double values[] = {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
  return list(values, 6);
}

Vec3 read_bias(YamlReader& yaml, const char* field, double largest) {
  const std::vector<double> values = yaml.numbers(yaml.root(), field, 3);
  const Vec3 bias(values[0], values[1], values[2]);
  if (!(bias.cwiseAbs().maxCoeff() <= largest))
    yaml.complain(yaml.root(), field, fmt::format("is more than {}, too much for a bias", largest));
  return bias;
}

Mat3 read_covariance(YamlReader& yaml, const char* field) {
  const std::vector<double> v = yaml.numbers(yaml.root(), field, 6);
  Mat3 m;
  m << v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5];
  // No principal minor is negative; a decomposition has no place in a module that is not optimised.
  const auto minor = [&](int i, int j) { return m(i, i) * m(j, j) - m(i, j) * m(i, j); };
  const bool covariance = m.allFinite() && m.diagonal().minCoeff() >= 0 && minor(0, 1) >= 0 && minor(0, 2) >= 0 &&
                          minor(1, 2) >= 0 && m.determinant() >= 0;
  if (!covariance) yaml.complain(yaml.root(), field, "is not a covariance");
  return m;
}

/// Both numbers or none: files of before had none.
std::optional<TimeOffsetEstimate> read_time_offset(YamlReader& yaml) {
  if (!yaml.has(yaml.root(), "time_offset_s") && !yaml.has(yaml.root(), "time_offset_sigma_s")) return std::nullopt;
  const TimeOffsetEstimate out{yaml.number(yaml.root(), "time_offset_s"), yaml.number(yaml.root(), "time_offset_sigma_s")};
  if (!(std::abs(out.s) <= kLargestTimeOffset_s))
    yaml.complain(yaml.root(), "time_offset_s", fmt::format("is more than {} s", kLargestTimeOffset_s));
  if (!(out.sigma_s > 0 && out.sigma_s <= kLargestTimeOffset_s))
    yaml.complain(yaml.root(), "time_offset_sigma_s", "is not a standard deviation");
  return out;
}

std::string text_of(const std::optional<TimeOffsetEstimate>& offset) {
  return offset ? fmt::format("time_offset_s: {:.17g}\ntime_offset_sigma_s: {:.17g}\n", offset->s, offset->sigma_s)
                : std::string();
}

bool same(const ImuNoise& a, const ImuNoise& b) {
  return a.gyro_noise_density_radps_rthz == b.gyro_noise_density_radps_rthz &&
         a.accel_noise_density_mps2_rthz == b.accel_noise_density_mps2_rthz &&
         a.gyro_random_walk_radps2_rthz == b.gyro_random_walk_radps2_rthz &&
         a.accel_random_walk_mps3_rthz == b.accel_random_walk_mps3_rthz && a.rate_hz == b.rate_hz && a.axes == b.axes;
}

}  // namespace

Result<ImuState> parse_imu_state(const std::string& text, const std::string& file, const ImuNoise& imu) {
  YamlReader yaml(file, text);
  const YAML::Node root = yaml.root();
  yaml.only(root, {"imu_state", "t_ns", "imu", "gyro_bias_radps", "accel_bias_mps2", "gyro_bias_covariance",
                   "accel_bias_covariance", "time_offset_s", "time_offset_sigma_s"});
  if (const double version = yaml.number(root, "imu_state"); yaml.ok() && version != 1)
    yaml.complain(root, "imu_state", fmt::format("version {} is not known, only 1", version));
  const ImuNoise noise = read_imu_noise(yaml, yaml.get(root, "imu"), "rate_hz");
  if (yaml.ok() && !same(noise, imu)) yaml.complain(root, "imu", "is another IMU than the one of this flight");
  ImuState state;
  const std::string t = yaml.word(root, "t_ns");
  const auto [end, wrong] = std::from_chars(t.data(), t.data() + t.size(), state.t.ns);
  if (yaml.ok() && (wrong != std::errc() || end != t.data() + t.size()))
    yaml.complain(root, "t_ns", fmt::format("'{}' is not a time in nanoseconds", t));
  state.biases.bias = {read_bias(yaml, "gyro_bias_radps", kLargestGyroBias_radps),
                       read_bias(yaml, "accel_bias_mps2", kLargestAccelBias_mps2)};
  state.biases.gyro_covariance = read_covariance(yaml, "gyro_bias_covariance");
  state.biases.accel_covariance = read_covariance(yaml, "accel_bias_covariance");
  state.time_offset = read_time_offset(yaml);
  if (!yaml.ok()) return yaml.error();
  return state;
}

Result<std::optional<ImuState>> read_imu_state(const std::string& path, const ImuNoise& imu) {
  std::error_code error;
  if (!std::filesystem::exists(path, error) && !error) return std::optional<ImuState>();
  const auto bytes = open_bytes(path);
  if (!bytes) return bytes.error();
  if ((*bytes)->size() > kLargestYaml_bytes)
    return Error{ErrorCode::malformed, fmt::format("{}: too large for an IMU's state", path)};
  const Result<ImuState> state = parse_imu_state((*bytes)->read(0, (*bytes)->size()), path, imu);
  if (!state) return state.error();
  return std::optional<ImuState>(*state);
}

std::string imu_state_to_yaml(const ImuState& state, const ImuNoise& n) {
  const ImuBiasEstimate& b = state.biases;
  return fmt::format(
             "# Biases of an IMU, and its time offset to the images, at the end of a flight (fbvins --imu-state), for the next one; "
             "covariances as upper triangles.\n"
             "imu_state: 1\nt_ns: {}\nimu:\n  rate_hz: {:.17g}\n",
             state.t.ns, n.rate_hz) +
         imu_noise_text(n, "  ", "{:.17g}") + imu_axes_text(n.axes, "  ", true) +
         fmt::format("gyro_bias_radps: {}\naccel_bias_mps2: {}\ngyro_bias_covariance: {}\naccel_bias_covariance: {}\n",
                     list(b.bias.gyro_radps.data(), 3), list(b.bias.accel_mps2.data(), 3), upper(b.gyro_covariance),
                     upper(b.accel_covariance)) +
         text_of(state.time_offset);
}

Result<void> write_imu_state(const std::string& path, const ImuState& state, const ImuNoise& imu) {
  return write_file_atomically(path, imu_state_to_yaml(state, imu));
}

}  // namespace fbvins
