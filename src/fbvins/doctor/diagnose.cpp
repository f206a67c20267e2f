// SPDX-License-Identifier: Apache-2.0
// The calibration as given against common mistakes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "fbvins/doctor/collect.hpp"
#include "fbvins/doctor/common_mistakes.hpp"
#include "fbvins/doctor/diagnose.hpp"
#include "fbvins/doctor/rig_diagnosis.hpp"

namespace fbvins {
namespace {

std::shared_ptr<const Image> flipped(const std::shared_ptr<const Image>& image, ImageFlip flip) {
  if (!image) return image;
  const int width = image->width(), height = image->height();
  auto out = std::make_shared<Image>(width, height);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* from = image->row(flip == ImageFlip::top_bottom ? height - 1 - y : y);
    if (flip == ImageFlip::left_right) std::reverse_copy(from, from + width, out->row(y));
    else std::copy(from, from + width, out->row(y));
  }
  return out;
}

Result<Evidence> gather_from(const StereoRig& rig, const Replay& replay, ImageFlip flip,
                             FlippedCameras which = FlippedCameras::both) {
  EvidenceCollector gatherer(rig);
  const Result<void> played = replay([&](SensorEvent event) {
    if (auto* frame = std::get_if<StereoFrame>(&event); frame != nullptr && flip != ImageFlip::none) {
      for (std::size_t i = 0; i < frame->images.size(); ++i)
        if (which == FlippedCameras::both || (which == FlippedCameras::left) == (i == 0))
          frame->images[i] = flipped(frame->images[i], flip);
    }
    return gatherer.push(event);
  });
  if (!played) return played.error();
  return gatherer.finish();
}

std::string px_text(const std::optional<double>& px) { return px ? fmt::format("{:.2f} px", *px) : "none"; }

Finding finding_of(const CommonMistake& mistake, const Diagnosis& as_given, const Diagnosis& without) {
  Finding finding;
  finding.kind = mistake.kind;
  finding.measured = fmt::format(
      "with {}, one cause explains what else are {} findings and {} points that cannot be judged; epipolar error {} (as given {}), error of a predicted feature {} (as given {})",
      mistake.what, as_given.findings.size(), as_given.not_judged.size(), px_text(without.epipolar_px),
      px_text(as_given.epipolar_px), px_text(without.predicted_px), px_text(as_given.predicted_px));
  finding.expected = "the calibration as given explains it";
  finding.advice = mistake.advice;
  finding.fields = mistake.fields;
  return finding;
}

/// As much is judged as with the calibration as given, and the cause with what is left to find costs less.
bool explains_better(const Diagnosis& with_it, const Diagnosis& other, int cost_of_other) {
  return with_it.epipolar_px && with_it.predicted_px && with_it.not_judged.size() <= other.not_judged.size() &&
         cost_of(with_it) + 1 < cost_of_other;
}

Result<Diagnosis> diagnose_group(const StereoRig& rig, const Replay& replay, CalibrationStyle style) {
  const Result<Evidence> evidence = gather_from(rig, replay, ImageFlip::none);
  if (!evidence) return evidence.error();
  const Diagnosis as_given = examine(*evidence, style);
  if (!rig.has_right() || !is_strange(as_given)) return as_given;  // common mistakes are told apart by the epipolar error
  if (std::ranges::find(as_given.findings, FindingKind::imu_stuck, &Finding::kind) != as_given.findings.end()) return as_given;
  Diagnosis best = as_given;
  int least = cost_of(as_given);
  for (const CommonMistake& mistake : common_mistakes(rig)) {
    if (!may_be(mistake, *evidence, as_given)) continue;
    const Result<Evidence> other = gather_from(mistake.rig, replay, mistake.flip, mistake.flipped);
    if (!other) return other.error();
    Diagnosis with_it = examine(*other, style);
    if (!explains_better(with_it, as_given, least)) continue;
    least = cost_of(with_it) + 1;
    with_it.findings.insert(with_it.findings.begin(), finding_of(mistake, as_given, with_it));
    with_it.epipolar_px = as_given.epipolar_px, with_it.predicted_px = as_given.predicted_px;
    write_lines(with_it.findings, with_it.rig, style);
    best = std::move(with_it);
  }
  return best;
}

Replay of_group(const Replay& replay, const CameraGroup& group) {
  return [&replay, group](const TakeEvent& take) {
    return replay([&](SensorEvent event) {
      const auto* frame = std::get_if<StereoFrame>(&event);
      if (frame == nullptr) return take(std::move(event));
      std::optional<StereoFrame> images = frame_of_group(*frame, group);
      return !images || take(*std::move(images));
    });
  };
}

/// Each pair of the rig, from which more is known, then each camera without a partner, and at last how those that overlap stand
/// to one another, by what was corrected in their own.
Result<Diagnosis> diagnose_groups(const StereoRig& rig, const Replay& replay, CalibrationStyle style) {
  Diagnosis all;
  all.rig = rig;
  bool first = true;
  std::vector<CameraGroup> groups = camera_groups(rig);
  std::ranges::stable_partition(groups, [](const CameraGroup& group) { return group.second.has_value(); });
  for (const CameraGroup& group : groups) {
    const Result<Diagnosis> found = diagnose_group(rig_of(rig, group), of_group(replay, group), style);
    if (!found) return found;
    add_group(*found, group, std::exchange(first, false), all);
  }
  for (const CameraGroup& pair : pairs_across(rig)) {
    const Result<Diagnosis> found = examine_with(rig_of(all.rig, pair), of_group(replay, pair), style);
    if (!found) return found;
    add_across(*found, pair, all);
  }
  return all;
}

/// Not of the calibrated shape.
bool is_cut(const ScaledLens& lens) {
  const double factor = static_cast<double>(lens.images.width) / lens.calibrated.width;
  return std::abs(factor * lens.calibrated.height - lens.images.height) > std::max(1.0, factor);
}

}  // namespace

std::optional<StereoRig> squeezed_rig(const StereoRig& rig, std::span<const ScaledLens> scaled) {
  if (rig.camera_count() > 2 || std::ranges::none_of(scaled, is_cut)) return std::nullopt;
  StereoRig out = rig;
  for (const ScaledLens& lens : scaled) {
    Camera& camera = out.cameras[static_cast<std::size_t>(lens.camera)].camera;
    if (!is_cut(lens) || camera.mask()) return std::nullopt;  // a mask was cut with the lens
    const double in_x = static_cast<double>(lens.images.width) / lens.calibrated.width;
    const double in_y = static_cast<double>(lens.images.height) / lens.calibrated.height;
    const double left_px = 0.5 * (lens.calibrated.width - lens.images.width);  // as if cut off there
    const double top_px = 0.5 * (lens.calibrated.height - lens.images.height);
    auto model = camera.model();
    std::visit(
        [&](auto& m) {
          m.fx *= in_x, m.fy *= in_y;
          m.cx = (m.cx + left_px + 0.5) * in_x - 0.5, m.cy = (m.cy + top_px + 0.5) * in_y - 0.5;
        },
        model);
    camera = camera.with_lens(model);
  }
  return out;
}

bool is_squeezed(const Diagnosis& squeezed, const Diagnosis& cropped) {
  return squeezed.predicted_px && squeezed.not_judged.size() <= cropped.not_judged.size() && cost_of(squeezed) < cost_of(cropped);
}

void tell_of_scaled(std::span<const ScaledLens> scaled, CalibrationStyle style, Diagnosis& found, bool squeezed) {
  if (scaled.empty()) return;
  using enum CalibrationField;
  Finding finding;
  finding.kind = FindingKind::calibration_size;
  finding.size = static_cast<double>(scaled.front().images.width) / scaled.front().calibrated.width;
  finding.unit = "times the calibration's size";
  std::string cameras;
  const ScaledLens* before = nullptr;
  for (const ScaledLens& lens : scaled) {
    cameras += fmt::format("{}cam{}", cameras.empty() ? "" : ", ", lens.camera);
    if (lens.camera == 0) finding.fields.insert(finding.fields.end(), {size_of_left, lens_of_left});
    if (lens.camera == 1) finding.fields.insert(finding.fields.end(), {size_of_right, lens_of_right});
    if (before != nullptr && before->images == lens.images && before->calibrated == lens.calibrated) continue;
    before = &lens;
    const char* comma = finding.measured.empty() ? "" : ", ";
    finding.measured += fmt::format("{}{} x {}", comma, lens.images.width, lens.images.height);
    finding.expected += fmt::format("{}{} x {}", comma, lens.calibrated.width, lens.calibrated.height);
  }
  finding.measured = fmt::format("the images of {} are {} pixels", cameras, finding.measured);
  finding.expected += " by the calibration";
  finding.advice =
      "calibrate at the size that is used, or scale focal lengths and centres: all else was judged with lenses scaled so";
  if (std::ranges::any_of(scaled, is_cut))
    finding.advice =
        "calibrate at the size that is used, or take from the centres what was cut off at the left and at the top: all else was judged as "
        "if the images were the middle of the calibrated ones; where they were cut elsewhere, it is seen as their principal point";
  if (squeezed)
    finding.advice = fmt::format(
        "the images were squeezed, in x by {:.3f} and in y by {:.3f}: scale them by one factor, or calibrate them as they are; all else was judged with lenses squeezed so",
        static_cast<double>(scaled.front().images.width) / scaled.front().calibrated.width,
        static_cast<double>(scaled.front().images.height) / scaled.front().calibrated.height);
  const bool is_pair = found.rig.camera_count() == 2;
  if (!is_pair) finding.fields.clear();  // lines name a pair's cameras
  found.findings.insert(found.findings.begin(), std::move(finding));
  if (is_pair) write_lines(found.findings, found.rig, style);
}

Result<Diagnosis> examine_with(const StereoRig& rig, const Replay& replay, CalibrationStyle style) {
  const Result<Evidence> evidence = gather_from(rig, replay, ImageFlip::none);
  if (!evidence) return evidence.error();
  return examine(*evidence, style);
}

Result<Diagnosis> diagnose(const StereoRig& rig, const Replay& replay, CalibrationStyle style) {
  return rig.camera_count() > 2 ? diagnose_groups(rig, replay, style) : diagnose_group(rig, replay, style);
}

}  // namespace fbvins
