// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/calibration_doubts.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "fbvins/core/angle.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {
namespace {

/// Drivers are late by up to some 0.1 s, and a shutter rolls over its image in less than 0.1 s.
constexpr double kLargestOffset_s = 0.3, kLongestReadout_s = 0.2;

void doubt_times(const StereoRig& rig, int number, std::vector<std::string>& out) {
  const CameraTimes times = rig.times(number);
  if (std::abs(times.time_offset_s) > kLargestOffset_s)
    out.push_back(fmt::format("calibration: camera {}'s time offset is {:g} s: is it in milliseconds, where seconds are meant?",
                              number, times.time_offset_s));
  const double readout_s = times.line_delay_s * rig.camera(number).height();
  if (std::abs(readout_s) > kLongestReadout_s)
    out.push_back(
        fmt::format("calibration: camera {}'s line delay of {:g} s makes {:g} s of an image: is it in microseconds, or of "
                    "the whole image, where seconds a row are meant?",
                    number, times.line_delay_s, readout_s));
  else if (times.line_delay_s < 0)
    out.push_back(
        fmt::format("calibration: camera {}'s line delay is negative ({:g} s): rows are taken from the bottom up only where "
                    "the driver turns the images upside down",
                    number, times.line_delay_s));
}

/// A focal length from that of the widest lens to a telescope's, in widths of the image; pixels that are a fifth wider than high;
/// a centre that far outside, in sizes of the image; a camera that far from the IMU.
constexpr double kShortest = 0.05, kLongest = 20, kLargestAspect = 1.2, kOutside = 0.25, kFarthest_m = 5;

void doubt_lens(const StereoRig& rig, int number, std::vector<std::string>& out) {
  const Camera& camera = rig.camera(number);
  const auto [fx, fy, cx, cy] = camera.intrinsics();
  const double width = camera.width(), height = camera.height();
  const auto doubt = [&](const std::string& what) { out.push_back(fmt::format("calibration: camera {}'s {}", number, what)); };
  if (fx < kShortest * width || fx > kLongest * width)
    doubt(fmt::format("focal length of {:g} px is hardly one of images of {:g} x {:g} pixels: is it in another unit?", fx, width,
                      height));
  else if (fx > kLargestAspect * fy || fy > kLargestAspect * fx)
    doubt(fmt::format("focal lengths of {:g} and {:g} px differ by more than pixels do: is the order fx, fy, cx, cy?", fx, fy));
  const auto outside = [](double centre, double size) { return centre < -kOutside * size || centre > (1 + kOutside) * size; };
  if (outside(cx, width) || outside(cy, height))
    doubt(fmt::format("centre ({:g}, {:g}) lies outside of its images of {:g} x {:g} pixels", cx, cy, width, height));
  else if (cx < kOutside * width / 2 && cy < kOutside * height / 2)
    doubt(fmt::format("centre ({:g}, {:g}) lies in a corner of its images of {:g} x {:g} pixels: are they cut, or is it a share?",
                      cx, cy, width, height));
  if (const double away_m = rig.T_BC(number).p.norm(); away_m > kFarthest_m)
    doubt(fmt::format("place is {:g} m from the IMU: is it in millimetres?", away_m));
}

struct Figure {
  const char* name;
  double value, least, most;
};

}  // namespace

std::vector<std::string> calibration_doubts(const StereoRig& rig) {
  std::vector<std::string> out;
  for (int i = 0; i < rig.camera_count(); ++i) doubt_lens(rig, i, out);
  for (int i = 0; i < rig.camera_count(); ++i)
    if (i == 0 || rig.camera(i).own_times() != CameraTimes{}) doubt_times(rig, i, out);
  const ImuNoise& n = rig.imu_noise;
  // From the best sensor that flies to the worst, with the factor of ten that many add.
  const Figure figures[] = {{"gyroscope's noise density", n.gyro_noise_density_radps_rthz, 1e-6, 0.05},
                            {"accelerometer's noise density", n.accel_noise_density_mps2_rthz, 1e-5, 0.5},
                            {"gyroscope's random walk", n.gyro_random_walk_radps2_rthz, 3e-8, 0.01},
                            {"accelerometer's random walk", n.accel_random_walk_mps3_rthz, 1e-7, 0.5}};
  bool plausible = true;
  for (const Figure& f : figures) {
    if (f.value >= f.least && f.value <= f.most) continue;
    plausible = false;
    out.push_back(
        fmt::format("calibration: the {} of {:g} is {} than that of any IMU in use ({:g} to {:g}): is it in another unit?",
                    f.name, f.value, f.value < f.least ? "smaller" : "larger", f.least, f.most));
  }
  if (plausible && n.gyro_noise_density_radps_rthz > n.accel_noise_density_mps2_rthz)
    out.push_back(
        fmt::format("calibration: the gyroscope's noise density ({:g} rad/s/sqrt(Hz)) is larger than the accelerometer's "
                    "({:g} m/s^2/sqrt(Hz)): are they exchanged?",
                    n.gyro_noise_density_radps_rthz, n.accel_noise_density_mps2_rthz));
  return out;
}

std::vector<std::string> chain_doubts(const std::string& camchain_path) {
  const Result<std::string> text = read_file(camchain_path, kLargestYaml_bytes);
  if (!text) return {};
  YamlReader yaml(camchain_path, *text);
  std::vector<std::string> out;
  const auto compare = [&](int i, const char* field, const char* what, const auto& said, const auto& used) {
    constexpr double kSamePlace_m = 5e-3, kSameDirection_rad = 0.01;
    const double turned_rad = so3_log(said.q * used.q.conjugate()).norm();
    if ((said.p - used.p).norm() > kSamePlace_m || turned_rad > kSameDirection_rad)
      out.push_back(
          fmt::format("{}: cam{}'s {} contradicts T_cam_imu: {} are {:.4f} m apart by the one, {:.4f} m by the other, and "
                      "turned by {:.2f} degrees between them; T_cam_imu is used",
                      camchain_path, i, field, what, said.p.norm(), used.p.norm(), kDegreesPerRad * turned_rad));
  };
  std::optional<Pose<C0, B>> before;
  for (int i = 0; i < kMostCameras; ++i) {
    const YAML::Node camera = yaml.get(yaml.root(), fmt::format("cam{}", i));
    if (!camera.IsMap() || !yaml.has(camera, "T_cam_imu")) break;
    const auto T_CB = read_transform<C0, B>(yaml, camera, "T_cam_imu");
    if (yaml.has(camera, "T_imu_cam"))
      compare(i, "T_imu_cam", "camera and IMU", read_transform<B, C0>(yaml, camera, "T_imu_cam"), T_CB.inverse());
    if (before && yaml.has(camera, "T_cn_cnm1"))
      compare(i, "T_cn_cnm1", "the cameras", read_transform<C0, C0>(yaml, camera, "T_cn_cnm1"), T_CB * before->inverse());
    if (!yaml.ok()) return {};
    before = T_CB;
  }
  return out;
}

}  // namespace fbvins
