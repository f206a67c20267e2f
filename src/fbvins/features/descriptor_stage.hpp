// SPDX-License-Identifier: Apache-2.0
// The seam between extraction and matching: a stage that may replace the descriptors of an image by
// better ones (paper 2.2.2, the learned booster). The default changes nothing.
// One instance is used by one thread at a time.
//
//   std::unique_ptr<DescriptorStage> stage = make_identity_stage();
//   stage->improve(752, 480, features);
#pragma once

#include <memory>

#include "fbvins/features/keypoint.hpp"

namespace fbvins {

class DescriptorStage {
 public:
  virtual ~DescriptorStage() = default;

  /// Rewrites features.descriptors in place, seeing all keypoints and descriptors of one image
  /// (width x height in px, to normalise positions). The number and order of features stay.
  virtual void improve(int width, int height, OrbFeatures& features) = 0;

  /// False where improve() leaves descriptors as they are. True: the features must come from an extractor that was asked for
  /// margins, without which the descriptors stay what they were.
  virtual bool changes_descriptors() const = 0;
};

/// Leaves descriptors as they are.
std::unique_ptr<DescriptorStage> make_identity_stage();

}  // namespace fbvins
