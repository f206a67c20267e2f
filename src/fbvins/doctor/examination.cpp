// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/examination.hpp"

#include <fmt/format.h>

#include <cmath>

#include "fbvins/checkup/noise_figures.hpp"
#include "fbvins/checkup/reading_faults.hpp"
#include "fbvins/checkup/reading_noise_seen.hpp"
#include "fbvins/checkup/reading_units.hpp"
#include "fbvins/checkup/stamps.hpp"
#include "fbvins/checkup/stereo_order.hpp"
#include "fbvins/doctor/blur.hpp"
#include "fbvins/doctor/depths.hpp"
#include "fbvins/doctor/fixed_view.hpp"
#include "fbvins/imu/nav_state.hpp"

namespace fbvins {

using doctor::kUnitTolerance;

Diagnosis Examination::run() {
  readings();
  images();
  if (has(FindingKind::same_image_twice)) {
    not_judged("everything that needs two cameras: left and right are the same images");
    return done();
  }
  pairs_ = pair_frames(evidence_);
  turns();
  stereo();
  if (turns_agree_) motion();
  if (accel_stuck_) not_judged("accelerometer, position of the camera on the IMU: an axis of the accelerometer is stuck");
  if (motion_agrees_ && has_depths() && !accel_stuck_) accelerations();
  if (motion_agrees_ && !accel_stuck_) force();
  blur();
  return done();
}

Diagnosis Examination::done() {
  write_lines(out_.findings, rig_, style_);
  out_.rig = rig_;
  out_.swapped = evidence_.swapped;
  return std::move(out_);
}

void Examination::not_judged(std::string_view what) { out_.not_judged.emplace_back(what); }

/// What no sensor can have measured; single readings are left out of what follows.
void Examination::impossible_readings() {
  for (const bool gyro : {true, false})
    if (auto finding = check_stuck(evidence_.imu, gyro)) {
      (gyro ? gyro_stuck_ : accel_stuck_) = true;
      out_.findings.push_back(*std::move(finding));
    }
  const Spikes spikes = find_spikes(evidence_.imu);
  if (spikes.at.empty()) return;
  keep(check_spikes(spikes));
  evidence_.imu = without(spikes, evidence_.imu);
  imu_ = ImuSeries(evidence_.imu);
}

void Examination::readings() {
  impossible_readings();
  for (Finding& finding : check_reading_units(evidence_.imu)) {
    if (finding.kind == FindingKind::accel_units) {
      const double gravity = finding.size * kGravity_mps2;
      // What is off by less than a factor of two is no other unit, but a scale or a bias, which the images tell.
      may_be_bias_ = finding.size > 0.5 && finding.size < 2;
      if (!may_be_bias_) accel_unit_ = kGravity_mps2 / gravity;
      for (const double unit : {1.0, 1000.0})
        if (std::abs(gravity / unit - 1) < kUnitTolerance) accel_unit_ = 9.80665 / unit;
    }
    // The gyroscope's unit is judged by the images, in turns().
    if (finding.kind != FindingKind::gyro_units) out_.findings.push_back(std::move(finding));
  }
  for (Finding& finding : check_stamps(evidence_.imu, evidence_.stamps, evidence_.rig)) {
    // Only a rate is one of a calibration's figures.
    if (!finding.fields.empty()) rig_.imu_noise.rate_hz = std::round(finding.size);
    out_.findings.push_back(std::move(finding));
  }
  if (auto finding = check_noise_figures(evidence_.rig.imu_noise)) {
    rig_.imu_noise = plausible(rig_.imu_noise);
    out_.findings.push_back(std::move(*finding));
  } else if (accel_unit_ == 1) {
    keep(check_declared_noise(evidence_.imu, evidence_.rig.imu_noise, rig_.imu_noise));
  }
  if (accel_unit_ == 1) {
    keep(check_saturation(evidence_.imu));
    keep(check_vibration(evidence_.imu));
  }
  if (const auto seen = reading_noise_seen(evidence_.imu))
    measured(fmt::format(
        "noise of the readings: at most {:.2g} rad/s and {:.2g} m/s^2 per sqrt(Hz), the calibration says {:.2g} and {:.2g}",
        seen->quietest.gyro_radps_rthz, seen->quietest.accel_mps2_rthz, evidence_.rig.imu_noise.gyro_noise_density_radps_rthz,
        evidence_.rig.imu_noise.accel_noise_density_mps2_rthz));
  const GravitySeen gravity = gravity_seen(evidence_.imu);
  const Vibration vibration = measure_vibration(evidence_.imu);
  measured(fmt::format(
      "gravity by the accelerometer: {:.3f} +- {:.3f}; vibration above {:.0f} Hz: {:.2f} m/s^2, strongest at {:.0f} Hz",
      gravity.norm_mps2, gravity.sigma_mps2, kVibrationFrom_hz, vibration.rms_mps2, vibration.peak_hz));
}

void Examination::right_images_late() {
  const StereoStep& step = evidence_.step;
  if (step.lag == 0) return;
  Finding& finding = found(FindingKind::stereo_sync, -1e3 * step.lag * step.period_s, 0, "ms");
  finding.measured = fmt::format(
      "the right image that belongs to a left one comes {} images {}: matches lie {:.1f} px from their epipolar lines with images of the same stamp, {:.1f} px with those",
      std::abs(step.lag), step.lag > 0 ? "later" : "earlier", step.as_stamped_px, step.in_step_px);
  finding.expected = "the same stamp for what was exposed at the same moment";
  finding.advice = "pair the images by the cameras' frame counters or trigger stamps, not by arrival";
}

void Examination::images() {
  for (Finding& finding : check_repeated(evidence_.repeated)) out_.findings.push_back(std::move(finding));
  if (evidence_.swapped) keep(check_stereo_order(evidence_.order));
  right_images_late();
  const FixedFeatures fixed = measure_fixed(evidence_, imu_);
  const std::optional<Finding> by_features = check_fixed(fixed);
  if (by_features && by_features->kind == FindingKind::projector_dots) keep(by_features);  // which a mask does not help
  else if (!fixed_in_view(fixed.share)) keep(by_features);
  if (has(FindingKind::fixed_in_view)) evidence_ = without(fixed.ids, std::move(evidence_));
  measured(fmt::format("features that stay in place: {:.1f} % ({} pairs of images); that look like bright spots: {:.1f} %",
                       100 * fixed.share, fixed.pairs, 100 * fixed.dots));
}

/// Whether a mask was found for it.
bool Examination::fixed_in_view(double share_of_features) {
  if (evidence_.views.empty()) return false;
  const FixedInView fixed = find_fixed(evidence_, imu_);
  evidence_.views.clear();
  std::string shares = fmt::format("{:.1f} % of the left image", 100 * fixed.share[0]);
  if (rig_.has_right()) shares += fmt::format(", {:.1f} % of the right one", 100 * fixed.share[1]);
  if (!fixed.judged()) not_judged("masks of what is fixed in view: the rig turns too little, or its readings do not say so");
  else measured(fmt::format("edges that stay in place: {} ({} pairs of images)", shares, fixed.pairs));
  if (!fixed.any()) return false;
  Finding& finding = found(FindingKind::fixed_in_view, std::max(fixed.share[0], fixed.share[1]), 0, "of the image");
  finding.measured =
      fmt::format("{} stay as they are while the scene moves, and {:.0f} % of the features", shares, 100 * share_of_features);
  finding.expected = "nothing of the vehicle in view";
  finding.advice =
      "give the calibration the masks that `fbvins doctor DATASET --out FOLDER` writes, or move the camera, or clean its lens";
  out_.masks = {fixed.masks[0], fixed.masks[1]};
  for (std::size_t i = 0; i < out_.masks.size(); ++i)
    if (out_.masks[i]) {
      rig_.cameras[i].camera.set_mask(out_.masks[i]);
      finding.fields.push_back(i == 0 ? CalibrationField::mask_of_left : CalibrationField::mask_of_right);
    }
  return true;
}

void Examination::blur() {
  if (turns_seen_ && !turns_agree_) return not_judged("blur: the rotation that causes it is not known");
  StereoRig rig = rig_;
  rig.time_offset_s = offset_s_;
  const Blur blur = measure_blur(evidence_, imu_, rig);
  measured(fmt::format("blur: an exposure of {:.1f} +- {:.1f} ms by {} images, {:.1f} px at {:.0f} px/s", 1e3 * blur.exposure_s,
                       1e3 * blur.sigma_s, blur.images, blur.length_px(), blur.speed_pxps));
  keep(check_blur(blur));
}

Diagnosis examine(const Evidence& evidence, CalibrationStyle style) { return Examination(evidence, style).run(); }

}  // namespace fbvins
