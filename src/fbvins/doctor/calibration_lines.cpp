// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/calibration_lines.hpp"

#include <fmt/format.h>

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
  return std::visit(
      [&](const auto& m) {
        return fmt::format("{}intrinsics: [{:.3f}, {:.3f}, {:.3f}, {:.3f}]", file_of(left, style), m.fx, m.fy, m.cx, m.cy);
      },
      camera.model());
}

std::string distortion_line(const Camera& camera, bool left, CalibrationStyle style) {
  const char* field = style == CalibrationStyle::euroc ? "distortion_coefficients" : "distortion_coeffs";
  if (const auto* m = std::get_if<PinholeRadtan>(&camera.model()))
    return fmt::format("{}{}: [{:.6f}, {:.6f}, {:.6f}, {:.6f}]", file_of(left, style), field, m->k1, m->k2, m->p1, m->p2);
  const auto& m = std::get<KannalaBrandt>(camera.model());
  return fmt::format("{}{}: [{:.6f}, {:.6f}, {:.6f}, {:.6f}]", file_of(left, style), field, m.k1, m.k2, m.k3, m.k4);
}

std::string time_line(double offset_s, CalibrationStyle style) {
  if (style == CalibrationStyle::euroc)
    return fmt::format(
        "a EuRoC folder has no line for it: add {:.4f} s to the stamps of the images, or subtract it from those of the readings",
        offset_s);
  return fmt::format("cam0, cam1: timeshift_cam_imu: {:.5f}", offset_s);
}

}  // namespace fbvins
