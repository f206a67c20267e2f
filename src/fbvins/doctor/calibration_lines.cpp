// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/calibration_lines.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <set>

#include "fbvins/camera/lens_numbers.hpp"
#include "fbvins/io/calibration_fields.hpp"

namespace fbvins {
namespace {

std::string file_of(bool left, CalibrationStyle style) {
  const char* camera = left ? "cam0" : "cam1";
  return style == CalibrationStyle::euroc ? fmt::format("{}/sensor.yaml: ", camera) : fmt::format("{}: ", camera);
}

std::string imu_file(CalibrationStyle style) { return style == CalibrationStyle::euroc ? "imu0/sensor.yaml: " : "imu.yaml: "; }

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

std::string size_line(const Camera& camera, bool left, CalibrationStyle style) {
  return fmt::format("{}resolution: [{}, {}]", file_of(left, style), camera.width(), camera.height());
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

/// Of each camera what the two have not in common.
std::string camera_lines(const StereoRig& rig, CalibrationStyle style,
                         const std::function<std::string(const CameraTimes&)>& entry) {
  const std::string first = entry(rig.times(0)), second = rig.has_right() ? entry(rig.times(1)) : first;
  const char* file = style == CalibrationStyle::euroc ? "/sensor.yaml" : "";
  if (second != first) return fmt::format("cam0{0}: {1}\ncam1{0}: {2}", file, first, second);
  const std::string cameras = rig.has_right() ? fmt::format("cam0{0}, cam1{0}", file) : fmt::format("cam0{}", file);
  return fmt::format("{}: {}", cameras, first);
}

std::string time_lines(const StereoRig& rig, CalibrationStyle style) {
  return camera_lines(rig, style, [](const CameraTimes& t) { return fmt::format("timeshift_cam_imu: {:.5f}", t.time_offset_s); });
}

std::string line_delay_lines(const StereoRig& rig, CalibrationStyle style) {
  return camera_lines(rig, style, [style](const CameraTimes& t) {
    return style == CalibrationStyle::euroc ? fmt::format("line_delay_us: {:.2f}", 1e6 * t.line_delay_s)
                                            : fmt::format("line_delay: {:.3e}", t.line_delay_s);
  });
}

std::string rate_line(const ImuNoise& noise, CalibrationStyle style) {
  return fmt::format("{}{}: {:.0f}", imu_file(style), style == CalibrationStyle::euroc ? "rate_hz" : "update_rate",
                     noise.rate_hz);
}

std::string noise_lines(const ImuNoise& noise, CalibrationStyle style) {
  std::string out = imu_noise_text(noise, imu_file(style), "{:.4g}");
  out.pop_back();  // the last newline
  return out;
}

bool is_of_right(CalibrationField field) {
  using enum CalibrationField;
  return field == mounting_of_right || field == size_of_right || field == lens_of_right || field == distortion_of_right ||
         field == mask_of_right;
}

}  // namespace

std::string line_of(CalibrationField field, const StereoRig& rig, CalibrationStyle style) {
  switch (field) {
    case CalibrationField::mounting_of_left: return mounting_line(rig.T_BC0(), true, style);
    case CalibrationField::mounting_of_right: return mounting_line(rig.T_BC1(), false, style);
    case CalibrationField::size_of_left: return size_line(rig.left(), true, style);
    case CalibrationField::size_of_right: return size_line(rig.right(), false, style);
    case CalibrationField::lens_of_left: return intrinsics_line(rig.left(), true, style);
    case CalibrationField::lens_of_right: return intrinsics_line(rig.right(), false, style);
    case CalibrationField::distortion_of_left: return distortion_line(rig.left(), true, style);
    case CalibrationField::distortion_of_right: return distortion_line(rig.right(), false, style);
    case CalibrationField::mask_of_left: return mask_line(true, style);
    case CalibrationField::mask_of_right: return mask_line(false, style);
    case CalibrationField::time_offset: return time_lines(rig, style);
    case CalibrationField::line_delay: return line_delay_lines(rig, style);
    case CalibrationField::imu_rate: return rate_line(rig.imu_noise, style);
    case CalibrationField::imu_noise: return noise_lines(rig.imu_noise, style);
  }
  return "";
}

void write_lines(std::span<Finding> findings, const StereoRig& rig, CalibrationStyle style) {
  std::set<CalibrationField> written;
  for (Finding& finding : findings) {
    finding.corrected.clear();
    for (const CalibrationField field : finding.fields) {
      if ((!rig.has_right() && is_of_right(field)) || !written.insert(field).second) continue;
      if (!finding.corrected.empty()) finding.corrected += '\n';
      finding.corrected += line_of(field, rig, style);
    }
  }
}

}  // namespace fbvins
