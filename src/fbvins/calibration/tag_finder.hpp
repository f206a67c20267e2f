// SPDX-License-Identifier: Apache-2.0
// Surveyed tags in the left image of a keyframe, as anchors of its body, and a mapper that gets them with every keyframe.
// One thread at a time.
//
//   Result<TagFinder> finder = TagFinder::create(rig, *load_tags("tags.yaml"));
//   TagMapper mapper(*std::move(finder), *map);
//   auto system = System::create(options, rig, RunMode::threaded, {.mapper = &mapper});
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "fbvins/calibration/board.hpp"
#include "fbvins/calibration/tag_family.hpp"
#include "fbvins/calibration/tag_survey.hpp"
#include "fbvins/camera/camera.hpp"
#include "fbvins/types/mapper.hpp"

namespace fbvins {

class TagFinder {
 public:
  /// An error in a build that cannot find tags.
  static Result<TagFinder> create(const StereoRig& rig, TagSurvey survey);

  /// Tags that the survey does not have, that are there twice, too small or bent are left out.
  std::vector<TagAnchor> find(const StereoFrame& frame);

 private:
  TagFinder(const StereoRig& rig, TagSurvey survey, TagDetector detector);
  std::optional<TagAnchor> posed(const TagDetection& seen, const ImageView& image) const;

  Camera camera_;
  Pose<B, C0> T_BC0_;
  TagSurvey survey_;
  Board board_;  ///< of one tag
  std::map<int, TagCells> cells_;
  TagDetector detector_;
};

class TagMapper final : public Mapper {
 public:
  TagMapper(TagFinder finder, Mapper& mapper) : finder_(std::move(finder)), mapper_(mapper) {}
  MapUpdate process(const Keyframe& keyframe) override;

 private:
  TagFinder finder_;
  Mapper& mapper_;
};

}  // namespace fbvins
