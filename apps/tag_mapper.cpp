// SPDX-License-Identifier: Apache-2.0
// Maps with --tags, of all programs but `fbvins`, which no_tag_mapper.cpp spares the compilation of what finds tags.
#include "apps/run_map.hpp"
#include "fbvins/calibration/tag_finder.hpp"

namespace fbvins::app {

Result<Mapper*> mapper_of(const MapArguments& arguments, const StereoRig& rig, LoopMap* map, std::unique_ptr<Mapper>& with_tags) {
  if (arguments.tags.empty()) return map;
  Result<TagSurvey> survey = load_tags(arguments.tags);
  if (!survey) return survey.error();
  Result<TagFinder> finder = TagFinder::create(rig, *std::move(survey));
  if (!finder) return finder.error();
  with_tags = std::make_unique<TagMapper>(*std::move(finder), *map);
  return with_tags.get();
}

}  // namespace fbvins::app
