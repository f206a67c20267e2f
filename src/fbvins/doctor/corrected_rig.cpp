// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/corrected_rig.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fbvins/camera/check_rig.hpp"
#include "fbvins/doctor/common_mistakes.hpp"
#include "fbvins/doctor/refine_corrected.hpp"
#include "fbvins/frontend/either_camera.hpp"

namespace fbvins {
namespace {

/// What is hidden by a large error shows when that is corrected, and is corrected in the next round.
constexpr int kRounds = 3;
/// Errors may be larger by this, which repeated examinations of the same recording differ by.
constexpr double kSameShare = 1.1, kSame_px = 0.1;

bool concerns_calibration(const Finding& finding) {
  return !finding.fields.empty() || finding.kind == FindingKind::swapped_images;
}

bool concerns_calibration(const Diagnosis& diagnosis) {
  return std::any_of(diagnosis.findings.begin(), diagnosis.findings.end(),
                     [](const Finding& f) { return concerns_calibration(f); });
}

std::string kinds_of(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    if (!text.empty()) text += ", ";
    text += to_string(finding.kind);
  }
  return text.empty() ? "none" : text;
}

/// Of the images as they are named.
StereoRig as_named(const Diagnosis& diagnosis) { return diagnosis.swapped ? mirrored(diagnosis.rig) : diagnosis.rig; }

Error no(std::string why) { return {ErrorCode::malformed, std::move(why)}; }

Result<void> fits_no_worse(const std::optional<double>& before, const std::optional<double>& after, const char* what) {
  if (!before) return {};
  if (!after) return no(fmt::format("the {} can no longer be judged", what));
  if (*after <= kSameShare * *before + kSame_px) return {};
  return no(fmt::format("the {} grows from {:.2f} to {:.2f} px", what, *before, *after));
}

/// Takes what a flight refines of a corrected calibration, where the recording examined again with it is explained as well.
Result<void> refine(std::span<const Finding> corrected_for, const Replay& replay, CalibrationStyle style,
                    CorrectedRig& corrected) {
  const Result<std::optional<StereoRig>> refined = refined_by_flight(*corrected.rig, corrected_for, replay);
  if (!refined) return refined.error();
  if (!*refined || !check_rig(**refined, "the refined calibration")) return {};
  Result<Diagnosis> after = examine_with(**refined, replay, style);
  if (!after) return after.error();
  if (cost_of(*after) > cost_of(corrected.after)) return {};
  for (const auto& [before_px, after_px] :
       {std::pair{corrected.after.epipolar_px, after->epipolar_px}, std::pair{corrected.after.predicted_px, after->predicted_px}})
    if (!fits_no_worse(before_px, after_px, "")) return {};
  corrected.rig = **refined, corrected.after = *std::move(after);
  return {};
}

}  // namespace

Result<void> is_better(const Diagnosis& before, const Diagnosis& after) {
  if (cost_of(after) >= cost_of(before))
    return no(fmt::format("as much is wrong with the corrected calibration as before (before: {}; with it: {})",
                          kinds_of(before.findings), kinds_of(after.findings)));
  if (auto same = fits_no_worse(before.epipolar_px, after.epipolar_px, "epipolar error"); !same) return same;
  return fits_no_worse(before.predicted_px, after.predicted_px, "error of a predicted feature");
}

Result<CorrectedRig> correct_rig(const StereoRig& rig, const Diagnosis& before, const Replay& replay, CalibrationStyle style) {
  CorrectedRig corrected;
  corrected.after = before;
  if (std::any_of(before.findings.begin(), before.findings.end(),
                  [](const Finding& f) { return f.kind == FindingKind::images_mirrored; })) {
    corrected.why_not = "no calibration describes mirrored images";
    return corrected;
  }
  if (std::ranges::find(before.findings, FindingKind::imu_stuck, &Finding::kind) != before.findings.end()) {
    corrected.why_not = "an axis of the IMU is stuck, which may cause the other findings: repair it and record again";
    return corrected;
  }
  if (!concerns_calibration(before)) {
    corrected.why_not =
        before.findings.empty() ? "nothing is wrong" : "nothing of what is wrong can be corrected in a calibration";
    return corrected;
  }
  if (rig.depth) {
    corrected.why_not = "Kalibr's file has no depth sensor: put the lines into the recording's own calibration";
    return corrected;
  }
  if (rig.camera_count() > 2) {
    corrected.why_not = "the doctor judges a pair, and there are more cameras: --camera both takes the first two";
    return corrected;
  }
  std::vector<Finding> corrected_for;
  for (int round = 0; round < kRounds && concerns_calibration(corrected.after); ++round) {
    const StereoRig candidate = as_named(corrected.after);
    Result<void> judged = check_rig(candidate, "the corrected calibration");
    if (judged) {
      Result<Diagnosis> after = examine_with(candidate, replay, style);
      if (!after) return after.error();
      judged = is_better(corrected.after, *after);
      if (judged) {
        corrected_for.insert(corrected_for.end(), corrected.after.findings.begin(), corrected.after.findings.end());
        corrected.rig = candidate, corrected.after = *std::move(after);
      }
    }
    if (judged) continue;
    if (!corrected.rig) corrected.why_not = judged.error().message;
    break;
  }
  if (corrected.rig)
    if (Result<void> done = refine(corrected_for, replay, style, corrected); !done) return done.error();
  return corrected;
}

}  // namespace fbvins
