// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_view.hpp"

#include "fbvins/core/stage_timer.hpp"

namespace fbvins {

double OrbDescriber::improve(const ImageView& image, OrbFeatures& features) {
  CpuTimer timer;
  stage_->improve(image.width, image.height, features);
  return timer.lap_ms();
}

double OrbDescriber::describe(const ImageView& image, OrbView& view, const Mask* mask) {
  extractor_.extract(image, view.features, mask);
  view.improved = stage_->changes_descriptors();
  if (view.improved) {
    view.raw.keypoints = view.features.keypoints;
    view.raw.descriptors = view.features.descriptors;
  }
  const double ms = improve(image, view.features);
  view.grid.build(image.width, image.height, view.features.keypoints);
  view.used.assign(view.features.size(), 0);
  return ms;
}

double OrbDescriber::describe(const ImageView& image, OrbFeatures& features, const Mask* mask) {
  extractor_.extract(image, features, mask);
  return improve(image, features);
}

}  // namespace fbvins
