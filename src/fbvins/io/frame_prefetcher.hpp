// SPDX-License-Identifier: Apache-2.0
// Private to io: loads frames ahead on a thread of its own, in order, a bounded number of them.
// next() and the destructor belong to one thread. Destroying it early stops after the frame in work.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "fbvins/io/dataset.hpp"

namespace fbvins {

class FramePrefetcher {
 public:
  /// `frames` and `loader` must outlive this. depth 0: no thread, frames are loaded by next().
  FramePrefetcher(const std::vector<FrameEntry>& frames, FrameLoader& loader, int depth);
  ~FramePrefetcher();
  FramePrefetcher(const FramePrefetcher&) = delete;
  FramePrefetcher& operator=(const FramePrefetcher&) = delete;

  /// The next frame of the list; nullopt at its end.
  std::optional<LoadedFrame> next();

 private:
  void work();
  LoadedFrame load(std::size_t index);

  const std::vector<FrameEntry>& frames_;
  FrameLoader& loader_;
  std::size_t depth_;
  std::size_t delivered_ = 0;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<LoadedFrame> ready_;  // guarded by mutex_
  bool stop_ = false;              // guarded by mutex_
  std::thread thread_;
};

}  // namespace fbvins
