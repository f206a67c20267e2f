// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mavlink/flown_map.hpp"

namespace fbvins {

void FlownMap::take(const MapUpdate& update) {
  if (!update.localised) return;
  const bool another_W = reset_counter_ && *reset_counter_ != update.reset_counter;
  if (another_W || update.found || (update.anchored && update.M_moved)) ++jumps_;
  reset_counter_ = update.reset_counter;
  T_MW_ = update.T_MW_smooth;
}

std::optional<Pose<M, W>> FlownMap::T_MW(std::uint32_t reset_counter) const {
  return reset_counter_ == reset_counter ? std::optional(T_MW_) : std::nullopt;
}

}  // namespace fbvins
