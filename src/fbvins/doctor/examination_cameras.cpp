// SPDX-License-Identifier: Apache-2.0
// Lenses and the pair of cameras.
#include "fbvins/doctor/examination.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "fbvins/core/angle.hpp"
#include "fbvins/doctor/depths.hpp"
#include "fbvins/doctor/lens_change.hpp"
#include "fbvins/doctor/stereo_problem.hpp"

namespace fbvins {
namespace {

/// Epipolar error that no single change explains.
constexpr double kMostEpipolar_px = 1.2;

/// "the ... focal length".
std::string_view name_of(WhichLens which) {
  return which == WhichLens::left ? "left camera's" : which == WhichLens::right ? "right camera's" : "two cameras'";
}

std::string regions_text(const RegionErrors& regions) {
  std::string text;
  for (int r = 0; r < kRegions; ++r)
    text += fmt::format("{}{:+.1f} {:+.1f} {:+.1f}", r == 0 ? "" : " / ", regions[static_cast<std::size_t>(3 * r)],
                        regions[static_cast<std::size_t>(3 * r + 1)], regions[static_cast<std::size_t>(3 * r + 2)]);
  return text;
}

bool begins_with_delay(const StereoFit& fit) {
  return !fit.changes.empty() && fit.changes.front().kind == FindingKind::stereo_sync;
}

}  // namespace

void Examination::lens(FindingKind kind, WhichLens which, const Eigen::VectorXd& amount, const Eigen::VectorXd& sigma,
                       double explained_px) {
  const std::string_view camera = name_of(which);
  LensChange change;
  Finding finding;
  finding.kind = kind;
  if (kind == FindingKind::focal_length) {
    change.log_focal = amount(0);
    finding.size = 100 * (std::exp(-amount(0)) - 1), finding.sigma = 100 * sigma(0), finding.unit = "%";
    finding.measured = fmt::format("the {} focal length in the calibration is {:.1f} +- {:.1f} % too {}", camera,
                                   std::abs(finding.size), finding.sigma, finding.size > 0 ? "long" : "short");
  } else if (kind == FindingKind::principal_point) {
    change.centre_px = amount;
    finding.size = amount.norm(), finding.sigma = sigma.norm(), finding.unit = "px";
    finding.measured = fmt::format("the {} principal point lies ({:.1f} +- {:.1f}, {:.1f} +- {:.1f}) px from the calibration's",
                                   camera, amount(0), sigma(0), amount(1), sigma(1));
  } else {
    const RadialNames names = radial_names(which == WhichLens::right ? rig_.right() : rig_.left());
    change.radial = amount;
    finding.size = amount(0), finding.sigma = sigma(0), finding.unit = fmt::format("of {}", names.first);
    finding.measured = fmt::format("the {} distortion is not the calibration's: {} {:+.3f} +- {:.3f}, {} {:+.3f} +- {:.3f}",
                                   camera, names.first, amount(0), sigma(0), names.second, amount(1), sigma(1));
  }
  const bool bent = kind == FindingKind::distortion;
  if (which != WhichLens::right) {
    rig_.cameras[0].camera = changed(rig_.left(), change);
    finding.fields.push_back(bent ? CalibrationField::distortion_of_left : CalibrationField::lens_of_left);
  }
  if (which != WhichLens::left) {
    rig_.cameras[1].camera = changed(rig_.right(), change);
    finding.fields.push_back(bent ? CalibrationField::distortion_of_right : CalibrationField::lens_of_right);
  }
  finding.expected = fmt::format("less than the accuracy of features; this explains {:.1f} px", explained_px);
  finding.advice = "calibrate the lens again, at the size and focus that are used";
  out_.findings.push_back(std::move(finding));
}

StereoFit Examination::pair_fit(StereoRig rig, bool focal_known) {
  rig.time_offset_s = offset_s_;
  // If right images are so late that there are no depths to measure rotation with, the gyroscope is used unchecked.
  const ImuSeries* imu = turns_agree_ || !turns_seen_ ? &imu_ : nullptr;
  StereoFit fit = fit_stereo(evidence_.stereo, rig, imu, pairs_, focal_known);
  // The pairs' motions need depths, which late right images make wrong; rotation alone, without the pairs, shows the delay, too.
  if (!fit.changes.empty() && !begins_with_delay(fit))
    if (StereoFit by_turning = fit_stereo(evidence_.stereo, rig, imu, {}, focal_known); begins_with_delay(by_turning))
      fit = std::move(by_turning);
  return fit;
}

void Examination::stereo() {
  if (!rig_.has_right()) return;
  const StereoFit fit = pair_fit(rig_, false);
  pair_ = {.before = rig_, .first_finding = out_.findings.size(), .changes = fit.changes};
  const auto views = static_cast<double>(std::max<std::size_t>(evidence_.stereo.size(), 1));
  measured(fmt::format("epipolar error of {} matches in {} images: {:.2f} px, by region {}; after {} changes {:.2f}", fit.matches,
                       views, fit.error_px, regions_text(fit.regions), fit.changes.size(), fit.remaining_px));
  for (const StereoChange& change : fit.changes)
    measured(fmt::format("  stereo: {} ({}) {} +- {} explains {:.2f} px", to_string(change.kind), name_of(change.lens),
                         change.amount.norm(), change.covariance.diagonal().cwiseSqrt().norm(), change.explained_px));
  if (has(FindingKind::fixed_in_view) || has(FindingKind::projector_dots)) {
    not_judged("the pair of cameras: features that are fixed in view would be taken for points of the scene");
    return;
  }
  if (evidence_.untriggered) {
    not_judged("the pair of cameras: they have no common trigger, so their images are of different moments");
    return;
  }
  if (fit.changes.empty() && fit.error_px == 0) {
    not_judged("the pair of cameras: too few points are seen in both images");
    out_.no_verdict =
        "too few points are seen in both images, without which there is no flight with two cameras: look at both (is one dark, blurred, mirrored, turned, or of another scene?), and record before a textured scene";
    return;
  }
  pair_.judged = true;
  out_.epipolar_px = fit.error_px;
  for (const StereoChange& change : fit.changes) stereo_change(change);
  pairs_ = pair_frames(with_depths_by(rig_, evidence_));
  if (fit.remaining_px > kMostEpipolar_px && !has(FindingKind::stereo_sync)) {
    Finding& finding = found(FindingKind::epipolar_error, fit.remaining_px, 0, "px");
    finding.measured = fmt::format("matches lie {:.2f} px from their epipolar lines, by region of the left image {}",
                                   fit.remaining_px, regions_text(fit.remaining));
    finding.expected = "a few tenths of a pixel everywhere, and no single change of the calibration makes it so";
    finding.advice = "calibrate the cameras again; where one region errs, a lens has moved";
  }
}

void Examination::stereo_change(const StereoChange& change) {
  const Eigen::VectorXd sigma = change.covariance.diagonal().cwiseSqrt();
  if (change.kind == FindingKind::right_camera_turned || change.kind == FindingKind::baseline_direction) {
    const bool turned = change.kind == FindingKind::right_camera_turned;
    Finding& finding = found(change.kind, kDegreesPerRad * change.amount.norm(), kDegreesPerRad * sigma.maxCoeff(), "deg");
    finding.measured =
        fmt::format("{} {:.2f} +- {:.2f} deg from the calibration's; this explains {:.1f} px of the epipolar error",
                    turned ? "the right camera is turned by" : "the direction from left to right camera is", finding.size,
                    finding.sigma, change.explained_px);
    finding.expected = "less than the accuracy of features";
    finding.advice = "a camera has moved: calibrate the pair again, and make its mount stiffer";
    Pose<C1, C0> T_C1C0 = rig_.T_C1C0();
    if (turned) {
      const Quat turn = so3_exp(Vec3(change.amount));
      T_C1C0 = {(turn * T_C1C0.q).normalized(), Vec3(turn * T_C1C0.p)};
    } else {
      T_C1C0.p = turned_baseline(T_C1C0.p, change.amount);
    }
    rig_.cameras[1].T_BC = (rig_.T_BC0() * T_C1C0.inverse()).cast_frames<B, C0>();
    finding.fields = {CalibrationField::mounting_of_right};
  } else if (change.kind == FindingKind::stereo_sync) {
    Finding& finding = found(change.kind, 1e3 * change.amount(0), 1e3 * sigma(0), "ms");
    finding.measured = fmt::format("the right image is exposed {:.2f} +- {:.2f} ms {} the left one of the same stamp",
                                   std::abs(finding.size), finding.sigma, finding.size > 0 ? "after" : "before");
    finding.expected = "at the same moment";
    finding.advice = "trigger both cameras together, or give each image the stamp of its own exposure";
  } else {
    lens(change.kind, change.lens, change.amount, sigma, change.explained_px);
  }
}

}  // namespace fbvins
