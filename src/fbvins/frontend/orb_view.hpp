// SPDX-License-Identifier: Apache-2.0
// The newest left image for all parts of the orb frontend: its keypoints with the descriptors in use, and the camera's pose.
// OrbDescriber fills it: extraction, and one look by the stage that may improve descriptors (paper 2.2.2). Which of them are
// improved is OrbImprover's matter.
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
#include "fbvins/frontend/orb_matching.hpp"
#include "fbvins/types/tracking.hpp"

namespace fbvins {

struct OrbView {
  std::int64_t index = 0;  ///< of usable left images, counted from 0
  Time t;
  std::optional<Pose<G, C0>> T_GC;      ///< predicted; none without a state of the estimator
  OrbFeatures features;                 ///< as extracted
  bool improves = false;                ///< whether descriptors are improved; the next four are of use only then
  bool all_improved = false;            ///< already, of all keypoints
  ImageContext context;                 ///< of the last image of which keypoints were detected
  std::vector<Descriptor> descriptors;  ///< of the keypoints: improved, or as extracted
  std::vector<std::uint8_t> improved;   ///< for each keypoint, whether its descriptor is improved
  KeypointGrid grid;
  std::vector<std::uint8_t> used;  ///< for each keypoint, whether a track has it

  const Descriptor& descriptor(std::size_t k) const { return improves ? descriptors[k] : features.descriptors[k]; }
  const Descriptor& raw_descriptor(std::size_t k) const { return features.descriptors[k]; }
  /// With descriptors as extracted.
  MatchCandidates as_extracted() const { return {features.keypoints, features.descriptors}; }
  /// With those in use. Where descriptors are improved, the others resemble nothing that was looked for.
  MatchCandidates comparable() const {
    return improves ? MatchCandidates{features.keypoints, descriptors, improved} : as_extracted();
  }
  /// What the descriptor is improved from.
  DescriptorInput input(std::size_t k) const { return {features.margins[k], features.keypoints[k], context.mean_log_score}; }
};

class OrbDescriber {
 public:
  /// `all`: improves all descriptors at once, as one camera needs (docs/experiments/speed.md).
  OrbDescriber(const OrbOptions& options, std::shared_ptr<DescriptorStage> stage, bool all = false)
      : stage_(std::move(stage)), extractor_(options, stage_->changes_descriptors()), all_(all) {}

  /// Fills all of the view that depends on the image alone, and on its camera's mask. Returns the CPU time that the stage took,
  /// ms.
  double describe(const ImageView& image, OrbView& view, const Mask* mask = nullptr);

 private:
  std::shared_ptr<DescriptorStage> stage_;
  OrbExtractor extractor_;
  bool all_;
};

}  // namespace fbvins
