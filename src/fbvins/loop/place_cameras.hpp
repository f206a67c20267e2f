// SPDX-License-Identifier: Apache-2.0
// The cameras of a rig by which places are recognised: of each pair that sees the same things the first, with depths by the
// second; without any pair each camera, with depths by its own earlier images. They see places in turns, so that many cost no
// more than one. While the first of a pair delivers nothing, the second sees places alone. One thread at a time, one flight.
//
//   PlaceCameras cameras(rig, {}, vocabulary, make_identity_stage());
//   if (auto camera = cameras.next(keyframe.images)) use(cameras.extract(*camera, keyframe), cameras.T_BC(*camera));
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/loop/place_extractor.hpp"

namespace fbvins {

class PlaceCameras {
 public:
  PlaceCameras(const StereoRig& rig, const PlaceExtractorOptions& options, const Vocabulary& vocabulary,
               const std::shared_ptr<DescriptorStage>& stage);

  std::size_t size() const { return cameras_.size(); }
  const Pose<B, C0>& T_BC(std::size_t camera) const { return cameras_[camera].T_BC; }
  /// Whose turn it is, of those that delivered an image: the one that has seen no place for longest. None where none did.
  std::optional<std::size_t> next(const StereoFrame& images) const;
  /// By this camera's image; the others remember theirs as earlier views.
  Place extract(std::size_t camera, const Keyframe& keyframe);

 private:
  struct PlaceCamera {
    CameraGroup group;
    std::optional<int> stands_in_for;  ///< the first of its pair
    Pose<B, C0> T_BC;
    PlaceExtractor extractor;
    std::uint64_t last_turn = 0;
  };

  std::vector<PlaceCamera> cameras_;
  std::uint64_t turn_ = 0;
};

}  // namespace fbvins
