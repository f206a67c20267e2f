// SPDX-License-Identifier: Apache-2.0
// The newest left image for all parts of the orb frontend: its keypoints with the descriptors in use, and the camera's pose.
// OrbDescriber fills it: extraction, and the stage that may improve descriptors (paper 2.2.2).
// Buffers are reused; one instance, one thread.
//
//   OrbDescriber describer(orb_options, make_identity_stage());
//   stats.boost_ms = describer.describe(image.view(), view, camera.mask().get());
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "fbvins/features/descriptor_stage.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/frontend/keypoint_grid.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

struct OrbView {
  std::int64_t index = 0;  ///< of usable left images, counted from 0
  Time t;
  std::optional<Pose<G, C0>> T_GC;  ///< predicted; none without a state of the estimator
  OrbFeatures features;
  OrbFeatures raw;  ///< the same before descriptors were improved; empty where they are as extracted
  bool improved = false;
  KeypointGrid grid;
  std::vector<std::uint8_t> used;  ///< for each keypoint, whether a track has it

  const Descriptor& descriptor(std::size_t k) const { return features.descriptors[k]; }
  /// The descriptor as extracted; zero where none was improved.
  Descriptor raw_descriptor(std::size_t k) const { return improved ? raw.descriptors[k] : Descriptor{}; }
};

class OrbDescriber {
 public:
  OrbDescriber(const OrbOptions& options, std::shared_ptr<DescriptorStage> stage)
      : stage_(std::move(stage)), extractor_(options, stage_->changes_descriptors()) {}

  /// Fills all of the view that depends on the image alone, and on its camera's mask. Returns the CPU time that improving took,
  /// ms.
  double describe(const ImageView& image, OrbView& view, const Mask* mask = nullptr);

 private:
  std::shared_ptr<DescriptorStage> stage_;
  OrbExtractor extractor_;
};

}  // namespace fbvins
