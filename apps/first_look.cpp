// SPDX-License-Identifier: Apache-2.0
#include "apps/first_look.hpp"

namespace fbvins::app {

void FirstLook::look_at(const SensorEvent& event) {
  const std::lock_guard lock(mutex_);
  if (!looking_) return;
  const Clock::time_point now = Clock::now();
  if (!begin_) begin_ = now;
  look_.push(event);
  if (!look_.is_over() && now - *begin_ < longest_) return;
  looking_ = false;  // from here on only the thread below reads
  reporting_ = std::jthread([this] {
    for (const Finding& finding : look_.findings()) on_finding_(finding);
  });
}

}  // namespace fbvins::app
