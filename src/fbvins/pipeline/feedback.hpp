// SPDX-License-Identifier: Apache-2.0
// Feedback from the estimator to the frontend: the newest state, which may be skipped, and the positions of landmarks that left
// the window, which may not. The frontend of frame k always gets the estimator's state after frame k - kLag, whatever the mode
// and the speed of the threads: this is why threads give the same bits.
//
//   feedback.publish(frame.id, estimator.prior(), std::move(estimate.landmarks));    // the estimator's thread
//   Feedback::Message message = feedback.for_frame(packet.id);                       // the frontend's thread
#pragma once

#include <array>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <utility>
#include <vector>

#include "fbvins/types/tracking.hpp"

namespace fbvins {

class Feedback {
 public:
  static constexpr std::int64_t kLag = 2;  ///< frames

  struct Message {
    StatePrior prior;
    std::vector<LandmarkUpdate> landmarks;  ///< those that no earlier message held, in order
  };

  void publish(FrameId frame, const StatePrior& prior, LandmarkUpdate landmarks);
  /// Waits until the estimator has finished frame - kLag.
  Message for_frame(FrameId frame);
  /// The same wait: keeps the caller from getting further ahead of the estimator. The correction of the time offset for this
  /// frame.
  Duration time_offset_for(FrameId frame);
  /// Ends all waiting, now and later.
  void stop();

 private:
  void wait_for(FrameId frame, std::unique_lock<std::mutex>& lock);

  std::mutex mutex_;
  std::condition_variable published_;
  std::array<StatePrior, 2 * kLag> priors_;  // after the last frames; that of frame f at f % size
  std::deque<std::pair<FrameId, LandmarkUpdate>> landmarks_;
  FrameId newest_;
  bool stopped_ = false;
};

}  // namespace fbvins
