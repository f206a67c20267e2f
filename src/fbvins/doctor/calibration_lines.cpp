// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/calibration_lines.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "fbvins/camera/lens_numbers.hpp"

namespace fbvins {
namespace {

std::string file_of(bool left, CalibrationStyle style) {
  const char* camera = left ? "cam0" : "cam1";
  return style == CalibrationStyle::euroc ? fmt::format("{}/sensor.yaml: ", camera) : fmt::format("{}: ", camera);
}

std::string row(const Mat3& R, const Vec3& p, int i) {
  return fmt::format("{:.9f}, {:.9f}, {:.9f}, {:.9f}", R(i, 0), R(i, 1), R(i, 2), p(i));
}

template <class Cam>
std::string mounting_line(const Pose<B, Cam>& T_BC, bool left, CalibrationStyle style) {
  const bool euroc = style == CalibrationStyle::euroc;
  const auto T_CB = T_BC.inverse();
  const Mat3 R = euroc ? T_BC.R() : T_CB.R();
  const Vec3 p = euroc ? T_BC.p : T_CB.p;
  if (euroc)
    return fmt::format("{}T_BS: data: [{}, {}, {}, 0, 0, 0, 1]", file_of(left, style), row(R, p, 0), row(R, p, 1), row(R, p, 2));
  return fmt::format("{}T_cam_imu: [[{}], [{}], [{}], [0, 0, 0, 1]]", file_of(left, style), row(R, p, 0), row(R, p, 1),
                     row(R, p, 2));
}

}  // namespace

std::string mounting_lines(const StereoRig& rig, CalibrationStyle style, bool both) {
  const std::string right = mounting_line(rig.T_BC1, false, style);
  return both ? mounting_line(rig.T_BC0, true, style) + "\n" + right : right;
}

std::string intrinsics_line(const Camera& camera, bool left, CalibrationStyle style) {
  const std::vector<double> numbers = kalibr_camera(camera).intrinsics;
  std::string out;
  for (std::size_t i = 0; i < numbers.size(); ++i)  // the last four are in px, those before them are the model's own
    out += fmt::format("{}{:.{}f}", i > 0 ? ", " : "", numbers[i], i + 4 < numbers.size() ? 6 : 3);
  return fmt::format("{}intrinsics: [{}]", file_of(left, style), out);
}

std::string distortion_line(const Camera& camera, bool left, CalibrationStyle style) {
  const std::vector<double> numbers = kalibr_camera(camera).coefficients;
  if (numbers.empty()) return intrinsics_line(camera, left, style);
  const char* field = style == CalibrationStyle::euroc ? "distortion_coefficients" : "distortion_coeffs";
  return fmt::format("{}{}: [{:.6f}]", file_of(left, style), field, fmt::join(numbers, ", "));
}

std::string mask_line(bool left, CalibrationStyle style) {
  return fmt::format("{}mask: mask{}.png", file_of(left, style), left ? 0 : 1);
}

std::string time_line(double offset_s, CalibrationStyle style) {
  if (style == CalibrationStyle::euroc)
    return fmt::format(
        "a EuRoC folder has no line for it: add {:.4f} s to the stamps of the images, or subtract it from those of the readings",
        offset_s);
  return fmt::format("cam0, cam1: timeshift_cam_imu: {:.5f}", offset_s);
}

}  // namespace fbvins
