// SPDX-License-Identifier: Apache-2.0
// The seam between extraction and matching: a stage that may replace the descriptors of an image by
// better ones (paper 2.2.2, the learned booster). The default changes nothing.
// All of an image at once; or one look at the image, and then those that are compared, now or later.
// One instance is used by one thread at a time.
//
//   std::unique_ptr<DescriptorStage> stage = make_identity_stage();
//   stage->improve(752, 480, features);
//
//   stage->look_at(752, 480, features, context);
//   stage->improve(context, inputs, descriptors);
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "fbvins/features/keypoint.hpp"

namespace fbvins {

/// What a stage has seen of an image as a whole.
struct ImageContext {
  int width = 0, height = 0;
  double mean_log_score = 0;   ///< of all its keypoints
  std::vector<float> summary;  ///< the stage's own
};

/// All that the descriptor of one keypoint is improved from, beside an image's context.
struct DescriptorInput {
  Margins margins;
  Keypoint keypoint;
  double mean_log_score = 0;  ///< of the keypoints of its image
};

class DescriptorStage {
 public:
  virtual ~DescriptorStage() = default;

  /// Rewrites features.descriptors in place, seeing all keypoints and descriptors of one image
  /// (width x height in px, to normalise positions). The number and order of features stay.
  virtual void improve(int width, int height, OrbFeatures& features) = 0;

  /// What improving some of these features needs to know of all; from a sample of them, in every image the same way.
  virtual void look_at(int width, int height, const OrbFeatures& features, ImageContext& out);
  /// Replaces the descriptors of these keypoints, one to one. They may be of an earlier image of the same size than the one that
  /// was looked at.
  virtual void improve(const ImageContext& context, std::span<const DescriptorInput> inputs, std::span<Descriptor> descriptors);

  /// False where improve() leaves descriptors as they are. True: the features must come from an extractor that was asked for
  /// margins, without which the descriptors stay what they were.
  virtual bool changes_descriptors() const = 0;
};

/// Leaves descriptors as they are.
std::unique_ptr<DescriptorStage> make_identity_stage();

}  // namespace fbvins
