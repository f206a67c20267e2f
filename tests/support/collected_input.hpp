// SPDX-License-Identifier: Apache-2.0
// For tests of sources: keeps all that a source delivers, from whatever threads.
//
//   CollectedInput input;
//   source->start(input);
//   ASSERT_TRUE(input.wait_for_frames(20, std::chrono::seconds(10)));
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <utility>
#include <vector>

#include "fbvins/live/source.hpp"

namespace fbvins {

struct CollectedInput final : SensorInput {
  void push(const ImuSample& sample) override {
    const std::lock_guard lock(mutex);
    readings.push_back(sample);
    changed.notify_all();
  }
  void push(StereoFrame frame) override {
    const std::lock_guard lock(mutex);
    frames.push_back(std::move(frame));
    changed.notify_all();
  }
  bool wait_for_frames(std::size_t count, std::chrono::seconds at_most) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, at_most, [&] { return frames.size() >= count; });
  }
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<ImuSample> readings;
  std::vector<StereoFrame> frames;
};

}  // namespace fbvins
