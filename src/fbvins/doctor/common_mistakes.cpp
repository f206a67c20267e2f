// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/common_mistakes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/camera/scaled_lens.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/core/median.hpp"

namespace fbvins {
namespace {

using enum CalibrationField;
const std::vector<CalibrationField> kMountings{mounting_of_left, mounting_of_right};
const std::vector<CalibrationField> kLenses{lens_of_left, lens_of_right};
const std::vector<CalibrationField> kAllOfLenses{lens_of_left, lens_of_right, distortion_of_left, distortion_of_right};
const std::vector<CalibrationField> kAll{mounting_of_left, mounting_of_right,  lens_of_left,
                                         lens_of_right,    distortion_of_left, distortion_of_right};

template <class Change>
Camera with_model(const Camera& camera, Change&& change) {
  auto model = camera.model();
  std::visit(change, model);
  return camera.with_lens(model);
}

/// Of the same camera upside down.
Camera half_turned(const Camera& camera) {
  return with_model(camera, [&](auto& m) {
    m.cx = camera.width() - 1 - m.cx, m.cy = camera.height() - 1 - m.cy;
    if constexpr (requires { m.p1; }) m.p1 = -m.p1, m.p2 = -m.p2;
  });
}

Mat3 half_turn() { return so3_exp(std::numbers::pi * Vec3::UnitZ()).toRotationMatrix(); }

StereoRig with_mountings(StereoRig rig, const Pose<B, C0>& T_BC0, const Pose<B, C1>& T_BC1) {
  rig.cameras[0].T_BC = T_BC0, rig.cameras[1].T_BC = T_BC1.cast_frames<B, C0>();
  return rig;
}

void add_inverted(const StereoRig& rig, std::vector<CommonMistake>& all) {
  const auto left = rig.T_BC0().inverse().cast_frames<B, C0>();
  const auto right = rig.T_BC1().inverse().cast_frames<B, C1>();
  const Pose<C0, C1> T_C0C1 = rig.T_BC0().inverse() * rig.T_BC1();
  const auto add = [&](const char* what, const Pose<B, C0>& T_BC0, const Pose<B, C1>& T_BC1,
                       const std::vector<CalibrationField>& fields) {
    all.push_back(
        {FindingKind::extrinsics_inverted, what,
         "give the transform in the format's direction: EuRoC's T_BS takes camera to IMU, Kalibr's T_cam_imu IMU to camera",
         with_mountings(rig, T_BC0, T_BC1), ImageFlip::none, fields});
  };
  add("both cameras' transforms to the IMU inverted", left, right, kMountings);
  add("the left camera's transform to the IMU inverted, and the right camera where it is beside it", left, left * T_C0C1,
      kMountings);
  add("the transform from camera to camera inverted", rig.T_BC0(), rig.T_BC0() * T_C0C1.inverse().cast_frames<C0, C1>(),
      {mounting_of_right});
  add("the right camera's transform to the IMU inverted", rig.T_BC0(), right, {mounting_of_right});
  add("the left camera's transform to the IMU inverted", left, rig.T_BC1(), {mounting_of_left});
}

void add_sizes(const StereoRig& rig, std::vector<CommonMistake>& all) {
  for (const auto& [factor, what] : {std::pair{2.0, "lenses of images of twice the calibration's size"},
                                     std::pair{0.5, "lenses of images of half the calibration's size"}}) {
    StereoRig other = rig;
    for (MountedCamera& mounted : other.cameras) mounted.camera = with_scaled_lens(mounted.camera, factor);
    all.push_back({FindingKind::calibration_size, what, "calibrate at the size that is used, or scale focal lengths and centres",
                   std::move(other), ImageFlip::none, kLenses});
  }
  StereoRig other = rig;
  other.cameras[0].camera = rig.left().with_lens(rig.right().model());
  other.cameras[1].camera = rig.right().with_lens(rig.left().model());
  all.push_back({FindingKind::swapped_images, "the two cameras' lenses exchanged", "exchange the lenses in the calibration",
                 std::move(other), ImageFlip::none, kAllOfLenses});
}

void add_images(const StereoRig& rig, std::vector<CommonMistake>& all) {
  StereoRig turned = rig;
  for (auto& [camera, T_BC] : turned.cameras) camera = half_turned(camera), T_BC.q = T_BC.q * Quat(half_turn());
  all.push_back({FindingKind::images_turned, "images that are upside down",
                 "deliver the images as they were calibrated, or take the lines below", std::move(turned), ImageFlip::none,
                 kAll});
  for (const auto& [flip, what, R] :
       {std::tuple{ImageFlip::left_right, "images that are mirrored left to right", Vec3(1, -1, -1)},
        std::tuple{ImageFlip::top_bottom, "images that are mirrored top to bottom", Vec3(-1, 1, -1)}})
    all.push_back({FindingKind::images_mirrored,
                   what,
                   "switch off the flip in the camera's driver: no calibration describes it",
                   rig,
                   flip,
                   {},
                   Mat3(R.asDiagonal())});
}

/// What one of the two cameras alone does.
void add_images_of_one(const StereoRig& rig, bool left, std::vector<CommonMistake>& all) {
  const std::string name = left ? "left" : "right";
  StereoRig turned = rig;
  MountedCamera& one = turned.cameras[left ? 0 : 1];
  one.camera = half_turned(one.camera);
  one.T_BC.q = one.T_BC.q * Quat(half_turn());
  std::vector<CalibrationField> fields{mounting_of_right, lens_of_right, distortion_of_right};
  if (left) fields = {mounting_of_left, lens_of_left, distortion_of_left};
  all.push_back({FindingKind::images_turned, fmt::format("the {} camera's images upside down", name),
                 "deliver the images as they were calibrated, or take the lines below", std::move(turned), ImageFlip::none,
                 fields});
  all.back().flipped = left ? FlippedCameras::left : FlippedCameras::right;
  for (const auto& [flip, how] :
       {std::pair{ImageFlip::left_right, "left to right"}, std::pair{ImageFlip::top_bottom, "top to bottom"}}) {
    all.push_back({FindingKind::images_mirrored, fmt::format("the {} camera's images mirrored {}", name, how),
                   "switch off the flip in that camera's driver: no calibration describes it", rig, flip});
    all.back().flipped = left ? FlippedCameras::left : FlippedCameras::right;
  }
}

Vec2 flipped(const Vec2& px, const Camera& camera, ImageFlip flip) {
  return {flip == ImageFlip::left_right ? camera.width() - 1 - px.x() : px.x(),
          flip == ImageFlip::top_bottom ? camera.height() - 1 - px.y() : px.y()};
}

/// Typical epipolar error of the evidence's matches under a mistake, as the images are named, px.
double epipolar_error_px(const CommonMistake& mistake, const Evidence& evidence) {
  std::vector<double> errors;
  for (const StereoView& view : evidence.stereo) {
    StereoView seen{view.t, {}};
    for (StereoPoint point : view.points) {
      if (evidence.swapped) std::swap(point.left, point.right);
      seen.points.push_back(
          {flipped(point.left, mistake.rig.left(), mistake.flip), flipped(point.right, mistake.rig.right(), mistake.flip)});
    }
    errors.push_back(epipolar_error_px(seen, mistake.rig));
  }
  return median(errors);
}

/// A factor that is that of no unit.
bool is_odd_factor(double factor) { return factor > 0.3 && factor < 3; }

bool has_few_matches(const std::string& not_judged) { return not_judged.starts_with("the pair of cameras: too few"); }

int open_figures(const Finding& finding) {
  switch (finding.kind) {
    case FindingKind::imu_camera_rotation:
    case FindingKind::imu_camera_position:
    case FindingKind::imu_camera_disagree:
    case FindingKind::right_camera_turned:
    case FindingKind::epipolar_error:
    case FindingKind::gyro_bias:
    case FindingKind::gyro_by_force:
    case FindingKind::accel_alignment:
    case FindingKind::accel_bias: return 3;
    case FindingKind::baseline_direction:
    case FindingKind::principal_point:
    case FindingKind::distortion:
    case FindingKind::gyro_axes:
    case FindingKind::accel_axes: return 2;
    case FindingKind::focal_length:
    case FindingKind::baseline_length:
    case FindingKind::gyro_scale:
    case FindingKind::accel_scale:
    case FindingKind::accel_late:
    case FindingKind::time_offset:
    case FindingKind::rolling_shutter:
    case FindingKind::stereo_sync: return 1;
    case FindingKind::gyro_units: return is_odd_factor(finding.size) ? 1 : 0;
    default: return 0;
  }
}

}  // namespace

std::vector<CommonMistake> common_mistakes(const StereoRig& rig) {
  std::vector<CommonMistake> all;
  add_inverted(rig, all);
  add_images(rig, all);
  add_images_of_one(rig, false, all);
  add_images_of_one(rig, true, all);
  add_sizes(rig, all);
  return all;
}

bool is_strange(const Diagnosis& as_given) {
  const auto strange = [](const Finding& f) {
    const double size = std::abs(f.size);
    switch (f.kind) {
      case FindingKind::imu_camera_rotation: return size > 30;
      case FindingKind::right_camera_turned: return size > 10;
      case FindingKind::baseline_direction: return size > 15;
      case FindingKind::focal_length: return size > 15;
      case FindingKind::gyro_scale: return size > 25;
      case FindingKind::principal_point: return size > 40;
      case FindingKind::gyro_units: return is_odd_factor(f.size);
      case FindingKind::gyro_axes:
      case FindingKind::accel_axes:
      case FindingKind::swapped_images:
      case FindingKind::epipolar_error:
      case FindingKind::imu_camera_disagree: return true;
      default: return false;
    }
  };
  // What looks like two wrong lenses may be two that are exchanged.
  const auto concerns = [&](CalibrationField lens, CalibrationField distortion) {
    return std::any_of(as_given.findings.begin(), as_given.findings.end(), [&](const Finding& f) {
      return std::ranges::find(f.fields, lens) != f.fields.end() || std::ranges::find(f.fields, distortion) != f.fields.end();
    });
  };
  if (concerns(lens_of_left, distortion_of_left) && concerns(lens_of_right, distortion_of_right)) return true;
  const bool unseen = std::any_of(as_given.not_judged.begin(), as_given.not_judged.end(), [](const std::string& text) {
    return has_few_matches(text) || text.starts_with("gyroscope, axes");
  });
  return unseen || std::any_of(as_given.findings.begin(), as_given.findings.end(), strange);
}

bool may_be(const CommonMistake& mistake, const Evidence& evidence, const Diagnosis& as_given) {
  constexpr double kGood_px = 2, kTurned = 8 * kDegree;
  if (mistake.kind == FindingKind::calibration_size) return true;  // the matches were chosen by the lenses
  // Of images one of which is mirrored there are no true matches, and nothing that needs them is known.
  if (mistake.flipped != FlippedCameras::both && mistake.flip != ImageFlip::none)
    return std::ranges::any_of(as_given.not_judged, has_few_matches);
  if (!evidence.stereo.empty() && epipolar_error_px(mistake, evidence) > kGood_px) return false;
  const bool axes_known =
      as_given.predicted_px && std::none_of(as_given.findings.begin(), as_given.findings.end(),
                                            [](const Finding& f) { return f.kind == FindingKind::gyro_axes; });
  if (!axes_known) return true;
  // Images found exchanged were given to the other camera, with nearly the same axes.
  const Mat3 away = as_given.rig.T_BC0().R().transpose() * mistake.rig.T_BC0().R() * mistake.seen_as;
  return so3_log(Quat(away)).norm() < kTurned;
}

int cost_of(const Diagnosis& diagnosis) {
  int cost = 2 * static_cast<int>(diagnosis.not_judged.size());
  for (const Finding& finding : diagnosis.findings) cost += 1 + open_figures(finding);
  return cost;
}

}  // namespace fbvins
