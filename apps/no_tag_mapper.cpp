// SPDX-License-Identifier: Apache-2.0
// Maps without tags: `fbvins` hands `run --tags` to fbvins-tools.
#include "apps/run_map.hpp"

namespace fbvins::app {

Result<Mapper*> mapper_of(const MapArguments& arguments, const StereoRig&, LoopMap* map, std::unique_ptr<Mapper>&) {
  if (arguments.tags.empty()) return map;
  return Error{ErrorCode::invalid_argument, arguments.tags + ": fbvins-tools finds tags, this program does not"};
}

}  // namespace fbvins::app
