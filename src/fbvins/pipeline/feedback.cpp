// SPDX-License-Identifier: Apache-2.0
#include "fbvins/pipeline/feedback.hpp"

namespace fbvins {

void Feedback::publish(FrameId frame, const StatePrior& prior, LandmarkUpdate landmarks) {
  const std::lock_guard lock(mutex_);
  priors_[static_cast<std::size_t>(frame.value) % priors_.size()] = prior;
  landmarks_.emplace_back(frame, std::move(landmarks));
  newest_ = frame;
  published_.notify_all();
}

void Feedback::wait_for(FrameId frame, std::unique_lock<std::mutex>& lock) {
  published_.wait(lock, [&] { return stopped_ || newest_.value >= frame.value - kLag; });
}

Duration Feedback::time_offset_for(FrameId frame) {
  std::unique_lock lock(mutex_);
  wait_for(frame, lock);
  const FrameId seen{frame.value - kLag};
  return seen.valid() ? priors_[static_cast<std::size_t>(seen.value) % priors_.size()].time_offset : Duration{};
}

Feedback::Message Feedback::for_frame(FrameId frame) {
  Message message;
  const FrameId seen{frame.value - kLag};
  if (!seen.valid()) return message;
  std::unique_lock lock(mutex_);
  wait_for(frame, lock);
  message.prior = priors_[static_cast<std::size_t>(seen.value) % priors_.size()];
  for (; !landmarks_.empty() && landmarks_.front().first <= seen; landmarks_.pop_front())
    message.landmarks.push_back(std::move(landmarks_.front().second));
  return message;
}

void Feedback::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  published_.notify_all();
}

}  // namespace fbvins
