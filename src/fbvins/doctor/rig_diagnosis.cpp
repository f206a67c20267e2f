// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/rig_diagnosis.hpp"

#include <fmt/format.h>

#include <cctype>
#include <utility>
#include <vector>

#include "fbvins/camera/group_images.hpp"

namespace fbvins {
namespace {

/// Known from the first group: the IMU, and one clock of all cameras.
bool concerns_all_groups(FindingKind kind) {
  switch (kind) {
    case FindingKind::clocks_apart:
    case FindingKind::clocks_drift:
    case FindingKind::time_offset:
    case FindingKind::accel_late:
    case FindingKind::image_stamps:
    case FindingKind::image_gaps: return true;
    default: return kind < FindingKind::clocks_apart;
  }
}

/// Share of a camera's view that another one has to see.
constexpr double kLeastOverlap = 1.0 / 3;

std::string named(const CameraGroup& group) {
  return group.second ? fmt::format("cameras {} and {} as left and right: ", group.first, *group.second)
                      : fmt::format("camera {}: ", group.first);
}

/// Lines of a calibration name the group's cameras cam0 and cam1, and their masks mask0 and mask1.
std::string renumbered(const std::string& lines, const CameraGroup& group) {
  std::string out;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const bool named = out.ends_with("cam") || out.ends_with("mask");
    const bool alone = i + 1 == lines.size() || std::isdigit(static_cast<unsigned char>(lines[i + 1])) == 0;
    if (named && alone && (lines[i] == '0' || lines[i] == '1'))
      out += fmt::to_string(lines[i] == '0' ? group.first : *group.second);
    else out += lines[i];
  }
  return out;
}

}  // namespace

std::optional<StereoFrame> frame_of_group(const StereoFrame& frame, const CameraGroup& group) {
  StereoFrame out = images_of(frame, group);
  if (out.without_images()) return std::nullopt;
  const Duration first = out.offsets.of(0), second = out.offsets.of(1);
  out.t = out.t + first;
  out.offsets = {};
  if (second != first) out.offsets.set(1, second - first);
  return out;
}

void add_group(const Diagnosis& found, const CameraGroup& group, bool first, Diagnosis& all) {
  const std::string who = named(group);
  for (Finding finding : found.findings) {
    const bool of_all = concerns_all_groups(finding.kind);
    if (of_all && !first) continue;
    if (!of_all) finding.measured = who + finding.measured;
    finding.corrected = renumbered(finding.corrected, group);
    all.findings.push_back(std::move(finding));
  }
  for (const std::string& sentence : found.measured) all.measured.push_back(who + sentence);
  for (const std::string& sentence : found.not_judged) all.not_judged.push_back(who + sentence);
  if (!found.no_verdict.empty() && all.no_verdict.empty()) all.no_verdict = who + found.no_verdict;
  if (first) {
    all.rig.imu_noise = found.rig.imu_noise;
    all.rig.time_offset_s = found.rig.time_offset_s - all.rig.camera(group.first).own_times().time_offset_s;
    all.epipolar_px = found.epipolar_px, all.predicted_px = found.predicted_px;
  }
  const std::optional<int> numbers[] = {group.first, group.second};
  all.masks.resize(static_cast<std::size_t>(all.rig.camera_count()));
  for (std::size_t i = 0; i < found.masks.size() && i < 2; ++i)
    if (numbers[i]) all.masks[static_cast<std::size_t>(*numbers[i])] = found.masks[i];
  if (found.swapped) return;  // its rig is for exchanged images
  std::vector<MountedCamera> cameras;
  for (int i = 0; i < all.rig.camera_count(); ++i) {
    cameras.push_back(i == group.first ? found.rig.mounted(0) : i == group.second ? found.rig.mounted(1) : all.rig.mounted(i));
    cameras.back().camera.set_own_times(all.rig.camera(i).own_times());
  }
  all.rig = with_cameras(all.rig, cameras);
}

std::vector<CameraGroup> pairs_across(const StereoRig& rig) {
  const std::vector<CameraGroup> groups = camera_groups(rig);
  const auto cameras_of = [](const CameraGroup& group) {
    return group.second ? std::vector{group.first, *group.second} : std::vector{group.first};
  };
  std::vector<CameraGroup> out;
  for (std::size_t i = 0; i < groups.size(); ++i)
    for (std::size_t k = i + 1; k < groups.size(); ++k) {
      CameraGroup pair;
      double most = kLeastOverlap;
      for (const int a : cameras_of(groups[i]))
        for (const int b : cameras_of(groups[k]))
          if (const double share = overlap(rig, a, b); share > most) most = share, pair = {a, b};
      if (pair.second) out.push_back(pair);
    }
  return out;
}

void add_across(const Diagnosis& found, const CameraGroup& pair, Diagnosis& all) {
  using enum FindingKind;
  const std::string who = named(pair);
  for (Finding finding : found.findings) {
    if (finding.kind != right_camera_turned && finding.kind != baseline_direction && finding.kind != epipolar_error) continue;
    finding.measured = who + finding.measured;
    finding.advice = "a camera or a pair has moved against the other: calibrate all cameras in one, and make their mount stiffer";
    finding.corrected.clear();
    finding.fields.clear();
    all.findings.push_back(std::move(finding));
  }
  if (found.epipolar_px)
    all.measured.push_back(who + fmt::format("matches lie {:.2f} px from their epipolar lines", *found.epipolar_px));
  else all.not_judged.push_back(who + "how they stand to each other, as too few points are seen in both, or not at one moment");
}

}  // namespace fbvins
