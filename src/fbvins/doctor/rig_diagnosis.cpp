// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/rig_diagnosis.hpp"

#include <fmt/format.h>

#include <cctype>
#include <utility>
#include <vector>

#include "fbvins/camera/group_images.hpp"

namespace fbvins {
namespace {

/// Known from the first pair: the IMU, and one clock of all cameras.
bool concerns_all_pairs(FindingKind kind) {
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

/// Lines of a calibration name the pair's cameras cam0 and cam1, and their masks mask0 and mask1.
std::string renumbered(const std::string& lines, const CameraGroup& pair) {
  std::string out;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const bool named = out.ends_with("cam") || out.ends_with("mask");
    const bool alone = i + 1 == lines.size() || std::isdigit(static_cast<unsigned char>(lines[i + 1])) == 0;
    if (named && alone && (lines[i] == '0' || lines[i] == '1'))
      out += fmt::to_string(lines[i] == '0' ? pair.first : *pair.second);
    else out += lines[i];
  }
  return out;
}

}  // namespace

std::optional<StereoFrame> frame_of_pair(const StereoFrame& frame, const CameraGroup& pair) {
  StereoFrame out = images_of(frame, pair);
  if (out.without_images()) return std::nullopt;
  const Duration first = out.offsets.of(0), second = out.offsets.of(1);
  out.t = out.t + first;
  out.offsets = {};
  if (second != first) out.offsets.set(1, second - first);
  return out;
}

void add_pair(const Diagnosis& of_pair, const CameraGroup& pair, bool first, Diagnosis& all) {
  const std::string who = fmt::format("cameras {} and {} as left and right: ", pair.first, *pair.second);
  for (Finding finding : of_pair.findings) {
    const bool of_all = concerns_all_pairs(finding.kind);
    if (of_all && !first) continue;
    if (!of_all) finding.measured = who + finding.measured;
    finding.corrected = renumbered(finding.corrected, pair);
    all.findings.push_back(std::move(finding));
  }
  for (const std::string& sentence : of_pair.measured) all.measured.push_back(who + sentence);
  for (const std::string& sentence : of_pair.not_judged) all.not_judged.push_back(who + sentence);
  if (first) {
    all.rig.imu_noise = of_pair.rig.imu_noise;
    all.rig.time_offset_s = of_pair.rig.time_offset_s - all.rig.camera(pair.first).own_times().time_offset_s;
    all.epipolar_px = of_pair.epipolar_px, all.predicted_px = of_pair.predicted_px;
  }
  const int numbers[] = {pair.first, *pair.second};
  all.masks.resize(static_cast<std::size_t>(all.rig.camera_count()));
  for (std::size_t i = 0; i < of_pair.masks.size() && i < 2; ++i)
    all.masks[static_cast<std::size_t>(numbers[i])] = of_pair.masks[i];
  if (of_pair.swapped) return;  // its rig is for exchanged images
  std::vector<MountedCamera> cameras;
  for (int i = 0; i < all.rig.camera_count(); ++i) {
    cameras.push_back(i == pair.first ? of_pair.rig.mounted(0) : i == *pair.second ? of_pair.rig.mounted(1) : all.rig.mounted(i));
    cameras.back().camera.set_own_times(all.rig.camera(i).own_times());
  }
  all.rig = with_cameras(all.rig, cameras);
}

}  // namespace fbvins
