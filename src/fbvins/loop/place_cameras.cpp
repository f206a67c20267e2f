// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_cameras.hpp"

#include <algorithm>

#include "fbvins/camera/group_images.hpp"

namespace fbvins {
namespace {

/// As a keyframe of rig_of(rig, group).
Keyframe seen_by(const CameraGroup& group, const Keyframe& keyframe) {
  Keyframe out = keyframe;
  out.images = images_of(keyframe.images, group);
  if (group.first == 0) out.images.depth = keyframe.images.depth;
  std::erase_if(out.landmarks, [&](const KeyframeLandmark& landmark) { return landmark.camera != group.first; });
  return out;
}

}  // namespace

PlaceCameras::PlaceCameras(const StereoRig& rig, const PlaceExtractorOptions& options, const Vocabulary& vocabulary,
                           const std::shared_ptr<DescriptorStage>& stage) {
  const auto add = [&](const CameraGroup& group, std::optional<int> stands_in_for) {
    cameras_.push_back({group, stands_in_for, rig.T_BC(group.first), {rig_of(rig, group), options, vocabulary, stage}});
  };
  const std::vector<CameraGroup> groups = camera_groups(rig);
  const bool pairs = std::ranges::any_of(groups, [](const CameraGroup& group) { return group.second.has_value(); });
  for (const CameraGroup& group : groups)
    if (group.second || !pairs) add(group, {});
  for (const CameraGroup& group : groups)
    if (group.second) add({*group.second, {}}, group.first);
}

std::optional<std::size_t> PlaceCameras::next(const StereoFrame& images) const {
  std::optional<std::size_t> next;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const PlaceCamera& camera = cameras_[i];
    if (!images.image(camera.group.first) || (camera.stands_in_for && images.image(*camera.stands_in_for))) continue;
    if (!next || camera.last_turn < cameras_[*next].last_turn) next = i;
  }
  return next;
}

Place PlaceCameras::extract(std::size_t which, const Keyframe& keyframe) {
  for (std::size_t i = 0; i < cameras_.size(); ++i)
    if (i != which) cameras_[i].extractor.remember(seen_by(cameras_[i].group, keyframe));
  cameras_[which].last_turn = ++turn_;
  return cameras_[which].extractor.extract(seen_by(cameras_[which].group, keyframe));
}

}  // namespace fbvins
