// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/orb_view.hpp"

#include "fbvins/core/stage_timer.hpp"

namespace fbvins {

double OrbDescriber::describe(const ImageView& image, OrbView& view, const Mask* mask) {
  extractor_.extract(image, view.features, mask);
  view.improves = stage_->changes_descriptors();
  double ms = 0;
  if (view.improves) {
    view.all_improved = all_;
    view.improved.assign(view.features.size(), all_ ? 1 : 0);
    CpuTimer timer;
    stage_->look_at(image.width, image.height, view.features, view.context);
    view.descriptors = view.features.descriptors;
    if (all_) {
      stage_->improve(image.width, image.height, view.features);
      view.descriptors.swap(view.features.descriptors);
    }
    ms = timer.lap_ms();
  }
  view.grid.build(image.width, image.height, view.features.keypoints);
  view.used.assign(view.features.size(), 0);
  return ms;
}

}  // namespace fbvins
