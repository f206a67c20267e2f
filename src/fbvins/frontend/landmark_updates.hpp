// SPDX-License-Identifier: Apache-2.0
// Checks that the estimator's updates come in order, and recognises repeated ones. One instance, one thread.
//
//   switch (updates.take(update)) { ... }
#pragma once

#include <cassert>

#include "fbvins/types/tracking.hpp"

namespace fbvins {

class LandmarkUpdates {
 public:
  enum class Kind {
    next,
    earlier_void,  ///< the next, and all earlier positions are void
    repeated,      ///< has been taken already
  };

  /// A gap is a bug of the caller: its positions would be lost.
  Kind take(const LandmarkUpdate& update) {
    if (update.sequence < next_) return Kind::repeated;
    assert(update.sequence == next_ && "landmark updates come without gaps and in order");
    next_ = update.sequence + 1;
    const bool reset = update.reset_counter != reset_counter_;
    reset_counter_ = update.reset_counter;
    return reset ? Kind::earlier_void : Kind::next;
  }

 private:
  std::int64_t next_ = 0;
  std::uint32_t reset_counter_ = 0;
};

}  // namespace fbvins
