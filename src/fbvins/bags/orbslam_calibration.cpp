// SPDX-License-Identifier: Apache-2.0
// ORB-SLAM3's configurations: Camera1.fx and so on (File.version 1.0), and the older ones with Camera.fx and Camera.bf.
#include <fmt/format.h>

#include <array>

#include "fbvins/bags/foreign_calibration.hpp"
#include "fbvins/camera/opencv_lens.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/image_decode.hpp"

namespace fbvins {
namespace {

/// "Camera1", "Camera2", or "Camera" of older files.
Camera read_lens(YamlReader& yaml, const std::string& name, const std::string& type) {
  const YAML::Node& root = yaml.root();
  const auto number = [&](const char* field) { return yaml.number(root, fmt::format("{}.{}", name, field)); };
  const auto if_there = [&](const char* field) {
    return yaml.has(root, fmt::format("{}.{}", name, field)) ? number(field) : 0.0;
  };
  const auto side = [&](const char* field) {
    const double px = yaml.number(root, field);
    if (yaml.ok() && !(px >= 1 && px <= kLargestImageSide_px)) yaml.complain(root, field, "is no number of pixels");
    return yaml.ok() ? static_cast<int>(px) : 1;
  };
  const std::array<double, 4> f{number("fx"), number("fy"), number("cx"), number("cy")};
  if (yaml.ok() && !(f[0] > 0 && f[1] > 0)) yaml.complain(root, name + ".fx", "the focal lengths are not positive");
  const int width = side("Camera.width"), height = side("Camera.height");
  if (!yaml.ok()) return {};
  if (type == "KannalaBrandt8")
    return *fisheye_camera(f, {number("k1"), number("k2"), number("k3"), number("k4")}, width, height);
  if (type == "Rectified") return *opencv_camera(f, {}, width, height);
  return *opencv_camera(f, {if_there("k1"), if_there("k2"), if_there("p1"), if_there("p2"), if_there("k3")}, width, height);
}

/// The matrix under the first of the names that is there.
template <class To, class From>
std::optional<Pose<To, From>> read_matrix(YamlReader& yaml, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const YAML::Node T = yaml.get(yaml.root(), name); T.IsDefined()) return read_transform<To, From>(yaml, T, "data");
  return std::nullopt;
}

/// Of the second camera against the first; a rectified pair has a distance alone, and older files that times fx.
std::optional<Pose<C0, C0>> second_camera(YamlReader& yaml) {
  const YAML::Node& root = yaml.root();
  if (const auto T = read_matrix<C0, C0>(yaml, {"Stereo.T_c1_c2", "Tlr"})) return T;
  const auto along_x = [](double x_m) { return Pose<C0, C0>(Quat::Identity(), Vec3(x_m, 0, 0)); };
  if (yaml.has(root, "Stereo.b")) return along_x(yaml.positive(root, "Stereo.b"));
  const bool depth = yaml.has(root, "DepthMapFactor") || yaml.has(root, "RGBD.DepthMapFactor");
  if (!yaml.has(root, "Camera.bf") || depth) return std::nullopt;
  return along_x(yaml.positive(root, "Camera.bf") / yaml.positive(root, "Camera.fx"));
}

ImuNoise read_noise(YamlReader& yaml) {
  const auto figure = [&](const char* name) { return yaml.positive(yaml.root(), name); };
  return {figure("IMU.NoiseGyro"), figure("IMU.NoiseAcc"), figure("IMU.GyroWalk"), figure("IMU.AccWalk"),
          figure("IMU.Frequency")};
}

}  // namespace

Result<StereoRig> parse_orbslam(YamlReader yaml) {
  const YAML::Node& root = yaml.root();
  const std::string type = yaml.has(root, "Camera.type") ? yaml.word(root, "Camera.type") : "PinHole";
  if (yaml.ok() && type != "PinHole" && type != "KannalaBrandt8" && type != "Rectified")
    yaml.complain(root, "Camera.type", fmt::format("'{}' is not supported, only PinHole, KannalaBrandt8 and Rectified", type));
  if (yaml.has(root, "LEFT.K"))
    yaml.complain(
        root, "LEFT.K",
        "of ORB-SLAM's older stereo files is not read: write the cameras as Kalibr's chain, or in its newer form (Camera1.fx)");
  const bool newer = yaml.has(root, "Camera1.fx");
  const Camera first = read_lens(yaml, newer ? "Camera1" : "Camera", type);
  if (!yaml.ok()) return yaml.error();
  const auto T_BC0 = read_matrix<B, C0>(yaml, {"IMU.T_b_c1", "Tbc"});
  if (!T_BC0)
    yaml.complain(root, newer ? "IMU.T_b_c1" : "Tbc",
                  "is missing: the camera's place on the IMU; calibrate with `fbvins calibrate`, or add it");
  if (!yaml.ok()) return yaml.error();
  std::vector<MountedCamera> cameras{{first, *T_BC0}};
  if (const auto T_C0C1 = second_camera(yaml)) {
    const bool own = yaml.has(root, "Camera2.fx") && type != "Rectified";
    cameras.push_back({own ? read_lens(yaml, "Camera2", type) : first, *T_BC0 * *T_C0C1});
  }
  if (!yaml.ok()) return yaml.error();
  StereoRig rig = with_cameras({}, cameras);
  rig.imu_noise = read_noise(yaml);
  if (!yaml.ok()) return yaml.error();
  if (Result<void> good = check_rig(rig, yaml.file()); !good) return good.error();
  return rig;
}

}  // namespace fbvins
