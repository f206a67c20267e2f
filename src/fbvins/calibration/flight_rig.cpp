// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/flight_rig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/core/angle.hpp"

namespace fbvins {
namespace {

/// How far calibrations in use are from the truth: those of boards much less, those of drawings more (docs/calibration.md).
constexpr double kLever_m = 0.02, kMounting_rad = 0.5 * kDegree, kTimeOffset_s = 3e-3;
constexpr double kBaseline_m = 1e-3, kBetween_rad = 0.2 * kDegree;
constexpr double kLens = 0.01;        ///< of the focal length
constexpr double kDistortion_px = 2;  ///< root mean square over the image
constexpr double kScale = 5e-3, kAxes_rad = 1e-3;

constexpr const char* kXyz = "xyz";

/// Root mean square over the image of what a unit of a distortion parameter moves, px.
double moved_by_unit_px(const Camera& camera, int parameter) {
  constexpr int kCells = 12;
  double sum = 0;
  int count = 0;
  for (int i = 0; i < kCells * kCells; ++i) {
    const Vec2 pixel((i % kCells + 0.5) * camera.width() / kCells, (i / kCells + 0.5) * camera.height() / kCells);
    const auto ray = camera.ray(pixel);
    LensDerivatives d;
    if (!ray || !project_point(camera.model(), *ray, &d)) continue;
    sum += d.parameters.col(parameter).squaredNorm();
    ++count;
  }
  return count == 0 ? 1 : std::max(std::sqrt(sum / count), 1e-9);
}

void add_lens(const Camera& camera, int k, std::vector<FlightParameter>& out) {
  const std::vector<std::string> names = lens_parameter_names(camera.model());
  for (int i = 0; i < static_cast<int>(names.size()); ++i) {
    const FlightGroup group = i < 2 ? FlightGroup::focal : i < 4 ? FlightGroup::centre : FlightGroup::distortion;
    const double sigma = i < 4 ? kLens * camera.focal_px() : kDistortion_px / moved_by_unit_px(camera, i);
    out.push_back({fmt::format("cam{}.{}", k, names[static_cast<std::size_t>(i)]), i < 4 ? "px" : "", group, k, sigma});
  }
}

void add_vector(const std::string& name, const char* unit, FlightGroup group, int camera, double sigma,
                std::vector<FlightParameter>& out) {
  for (int i = 0; i < 3; ++i) out.push_back({name + kXyz[i], unit, group, camera, sigma});
}

}  // namespace

FlightRig flight_rig(const StereoRig& rig) {
  FlightRig out;
  out.T_BC0 = rig.T_BC0();
  for (int k = 0; k < rig.camera_count(); ++k) {
    out.cameras.push_back(rig.camera(k));
    out.T_CnC0.push_back((rig.T_BC(k).inverse() * rig.T_BC0().cast_frames<B, C0>()).cast_frames<Cn, C0>());
  }
  out.T_CnC0[0] = {};
  out.time_offset_s = rig.time_offset_s;
  return out;
}

StereoRig refined_rig(StereoRig rig, const FlightRig& found) {
  std::vector<MountedCamera> cameras;
  for (std::size_t k = 0; k < found.cameras.size(); ++k)
    cameras.push_back({found.cameras[k], (found.T_BC0 * found.T_CnC0[k].inverse()).cast_frames<B, C0>()});
  rig = with_cameras(std::move(rig), cameras);
  rig.time_offset_s = found.time_offset_s;
  rig.imu_noise.axes = followed_by(rig.imu_noise.axes, {.gyro = found.axes.gyro, .accel = found.axes.accel});
  return rig;
}

std::vector<FlightParameter> flight_parameters(const FlightRig& rig) {
  std::vector<FlightParameter> out;
  add_vector("cam0.imu.p", "m", FlightGroup::lever, 0, kLever_m, out);
  add_vector("cam0.imu.r", "rad", FlightGroup::mounting, 0, kMounting_rad, out);
  out.push_back({"time_offset", "s", FlightGroup::time_offset, 0, kTimeOffset_s});
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      out.push_back({fmt::format("gyro.{}{}", kXyz[i], kXyz[j]), "", FlightGroup::gyro_axes, 0, i == j ? kScale : kAxes_rad});
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j)
      out.push_back({fmt::format("accel.{}{}", kXyz[i], kXyz[j]), "", FlightGroup::accel_axes, 0, i == j ? kScale : kAxes_rad});
  for (int k = 0; k < static_cast<int>(rig.cameras.size()); ++k) {
    if (k > 0) add_vector(fmt::format("cam{}.p", k), "m", FlightGroup::baseline, k, kBaseline_m, out);
    if (k > 0) add_vector(fmt::format("cam{}.r", k), "rad", FlightGroup::between_cameras, k, kBetween_rad, out);
    add_lens(rig.cameras[static_cast<std::size_t>(k)], k, out);
  }
  return out;
}

Eigen::VectorXd values(const FlightRig& rig) {
  std::vector<double> out;
  const auto add = [&](const Vec3& v) { out.insert(out.end(), v.data(), v.data() + 3); };
  add(rig.T_BC0.p), add(so3_log(rig.T_BC0.q));
  out.push_back(rig.time_offset_s);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.push_back(rig.axes.gyro(i, j));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) out.push_back(rig.axes.accel(i, j));
  for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
    if (k > 0) add(rig.T_CnC0[k].p), add(so3_log(rig.T_CnC0[k].q));
    for (const double value : lens_parameters(rig.cameras[k].model())) out.push_back(value);
  }
  return Eigen::Map<const Eigen::VectorXd>(out.data(), static_cast<Eigen::Index>(out.size()));
}

FlightRig moved(const FlightRig& rig, const Eigen::VectorXd& step) {
  FlightRig out = rig;
  out.T_BC0 = rig.T_BC0.boxplus(step.segment<3>(flight::lever), step.segment<3>(flight::mounting));
  out.time_offset_s += step[flight::time_offset];
  int at = flight::gyro;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.axes.gyro(i, j) += step[at++];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) out.axes.accel(i, j) += step[at++];
  for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
    if (k > 0) {
      out.T_CnC0[k] = rig.T_CnC0[k].boxplus(step.segment<3>(at), step.segment<3>(at + 3));
      at += 6;
    }
    const LensModel& lens = rig.cameras[k].model();
    const int count = lens_parameter_count(lens);
    if (!step.segment(at, count).isZero(0)) out.cameras[k] = rig.cameras[k].with_lens(moved_lens(lens, step.data() + at));
    at += count;
  }
  return out;
}

Eigen::VectorXd step_between(const FlightRig& from, const FlightRig& to) {
  Eigen::VectorXd out = values(to) - values(from);
  out.segment<3>(flight::mounting) = so3_log(from.T_BC0.q.conjugate() * to.T_BC0.q);
  for (std::size_t k = 1; k < from.cameras.size(); ++k)
    out.segment<3>(flight::first_of(from, static_cast<int>(k)) + 3) = so3_log(from.T_CnC0[k].q.conjugate() * to.T_CnC0[k].q);
  return out;
}

int flight::first_of(const FlightRig& rig, int camera) {
  int at = cameras;
  for (int k = 0; k < camera; ++k) at += lens_parameter_count(rig.cameras[static_cast<std::size_t>(k)].model()) + (k > 0 ? 6 : 0);
  return at;
}

}  // namespace fbvins
