// SPDX-License-Identifier: Apache-2.0
// Not public: what EuRoC's and Kalibr's calibration files have in common.
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/camera/check_rig.hpp"
#include "fbvins/camera/lens_numbers.hpp"
#include "fbvins/io/mask_fields.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {

inline constexpr std::uint64_t kLargestYaml_bytes = 1u << 20u;

/// A 4x4 rigid transform, row by row; complains unless the rotation is orthonormal to 1e-3.
struct RigidTransform {
  Quat q = Quat::Identity();
  Vec3 p = Vec3::Zero();
};
RigidTransform read_rigid_transform(YamlReader& yaml, const YAML::Node& map, const std::string& field);

/// The same, between the frames that the format defines for the field.
template <class To, class From>
Pose<To, From> read_transform(YamlReader& yaml, const YAML::Node& map, const std::string& field) {
  const RigidTransform T = read_rigid_transform(yaml, map, field);
  return {T.q, T.p};
}

/// "[1, 2.5]", each number without loss.
std::string yaml_list(const std::vector<double>& values);

/// camera_model, intrinsics, resolution, distortion_model, the coefficients in `coefficients_field`, and the mask, whose picture
/// `read` gets; without it only shapes may be there.
Camera read_camera(YamlReader& yaml, const YAML::Node& map, const std::string& coefficients_field, const ReadBeside& read = {});

/// The same of a file that people write and mix up: complains about a principal point outside the middle third of the image and
/// a distortion that no lens has, too.
Camera read_real_camera(YamlReader& yaml, const YAML::Node& map, const std::string& coefficients_field, const ReadBeside& read);

/// timeshift_cam_imu and, in seconds, line_delay, as in Kalibr's files. Without the first it is camera 0's, without the second
/// the shutter is global.
CameraTimes read_camera_times(YamlReader& yaml, const YAML::Node& map, double offset_of_first_s);

/// A depth sensor; keys that are missing have their defaults.
DepthSensor read_depth_sensor(YamlReader& yaml, const YAML::Node& map);
/// The same as text, each line after `indent`.
std::string depth_sensor_text(const DepthSensor& sensor, const std::string& indent);

/// The four noise figures, ranges and axes (imu_axes_fields.hpp); rate_field is "rate_hz" or "update_rate".
ImuNoise read_imu_noise(YamlReader& yaml, const YAML::Node& map, const std::string& rate_field);
/// The noise figures as text, without the rate, each line after `indent`; `number`: how fmt writes one.
std::string imu_noise_text(const ImuNoise& noise, const std::string& indent, fmt::string_view number);

}  // namespace fbvins
