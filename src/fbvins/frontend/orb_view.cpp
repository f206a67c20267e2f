// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_view.hpp"

#include "fbvins/core/stage_timer.hpp"

namespace fbvins {

double OrbDescriber::describe(const ImageView& image, OrbView& view, const Mask* mask) {
  extractor_.extract(image, view.features, mask);
  view.improved = stage_->changes_descriptors();
  if (view.improved) {
    view.raw.keypoints = view.features.keypoints;
    view.raw.descriptors = view.features.descriptors;
  }
  CpuTimer timer;
  stage_->improve(image.width, image.height, view.features);
  const double ms = timer.lap_ms();
  view.grid.build(image.width, image.height, view.features.keypoints);
  view.used.assign(view.features.size(), 0);
  return ms;
}

}  // namespace fbvins
