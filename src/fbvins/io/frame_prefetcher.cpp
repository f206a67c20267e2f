// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/frame_prefetcher.hpp"

#include <fmt/format.h>

#include <system_error>

namespace fbvins {

FramePrefetcher::FramePrefetcher(const std::vector<FrameEntry>& frames, FrameLoader& loader, int depth)
    : frames_(frames), loader_(loader), depth_(static_cast<std::size_t>(depth)) {
  if (depth_ == 0 || frames_.empty()) return;
  try {
    thread_ = std::thread([this] { work(); });
  } catch (const std::system_error&) {
    depth_ = 0;  // no thread available: slower, but the same result
  }
}

FramePrefetcher::~FramePrefetcher() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::optional<LoadedFrame> FramePrefetcher::next() {
  if (delivered_ == frames_.size()) return std::nullopt;
  const std::size_t index = delivered_++;
  if (depth_ == 0) return load(index);
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return !ready_.empty(); });
  LoadedFrame frame = std::move(ready_.front());
  ready_.pop_front();
  lock.unlock();
  changed_.notify_all();
  return frame;
}

void FramePrefetcher::work() {
  for (std::size_t index = 0; index < frames_.size(); ++index) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stop_ || ready_.size() < depth_; });
      if (stop_) return;
    }
    LoadedFrame frame = load(index);
    {
      const std::lock_guard lock(mutex_);
      ready_.push_back(std::move(frame));
    }
    changed_.notify_all();
  }
}

/// An exception of a decoder costs this frame only.
LoadedFrame FramePrefetcher::load(std::size_t index) {
  try {
    return loader_.load(frames_[index]);
  } catch (const std::exception& e) {
    LoadedFrame lost;
    lost.frame.t = frames_[index].t;
    lost.cameras.assign(2, {.corrupt = 1});
    lost.problem = fmt::format("frame {}: {}", frames_[index].t.ns, e.what());
    return lost;
  }
}

}  // namespace fbvins
