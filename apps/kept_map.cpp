// SPDX-License-Identifier: Apache-2.0
#include "apps/kept_map.hpp"

#include "apps/terminal.hpp"

namespace fbvins::app {

constexpr Duration kWritePeriod{30'000'000'000};

MapUpdate KeptMap::process(const Keyframe& keyframe) {
  MapUpdate update = map_.process(keyframe);
  if (wanted_.exchange(false) && told_) told_(map_.save(requested_file_));
  if (file_.empty()) return update;
  if (written_ == Time{}) written_ = keyframe.t;
  if (keyframe.t - written_ < kWritePeriod) return update;
  written_ = keyframe.t;
  const Result<void> saved = map_.save(file_);
  if (!saved && !warned_) warn(saved.error().message);
  warned_ = !saved;
  return update;
}

}  // namespace fbvins::app
