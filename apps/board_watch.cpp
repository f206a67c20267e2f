// SPDX-License-Identifier: Apache-2.0
#include "apps/board_watch.hpp"

#include <algorithm>
#include <utility>

#include "fbvins/types/owned_images.hpp"

namespace fbvins::app {
namespace {

constexpr int kMirrorTries = 40;  ///< images without any tag that are looked at mirrored, too

bool by_time(const ImuSample& a, const ImuSample& b) { return a.t < b.t; }

}  // namespace

Result<std::unique_ptr<BoardWatch>> BoardWatch::create(const Board& board, int threads) {
  std::vector<BoardDetector> detectors;
  for (int i = 0; i < threads; ++i) {
    Result<BoardDetector> detector = BoardDetector::create(board);
    if (!detector) return detector.error();
    detectors.push_back(*std::move(detector));
  }
  return std::unique_ptr<BoardWatch>(new BoardWatch(std::move(detectors)));
}

BoardWatch::BoardWatch(std::vector<BoardDetector> detectors) : detectors_(std::move(detectors)) {
  for (BoardDetector& detector : detectors_) threads_.emplace_back([this, &detector] { work(detector); });
}

BoardWatch::~BoardWatch() { finish(); }

void BoardWatch::finish() {
  {
    const std::lock_guard lock(mutex_);
    finished_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

void BoardWatch::push(const ImuSample& sample) {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  std::vector<ImuSample>& imu = recorded_.imu;
  const auto place = std::upper_bound(imu.begin(), imu.end(), sample, by_time);
  if (place == imu.begin() || (place - 1)->t != sample.t) imu.insert(place, sample);
}

void BoardWatch::push(StereoFrame frame) {
  if (frame.without_images()) return;
  {
    const std::lock_guard lock(mutex_);
    if (finished_) return;
    if (!first_) first_ = frame.t;
    look_.duration_s = (frame.t - *first_).seconds();
    look_.left_out += waiting_.has_value();
    waiting_ = owned(std::move(frame));
  }
  changed_.notify_one();
}

void BoardWatch::work(BoardDetector& detector) {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return finished_ || waiting_; });
    if (finished_) return;
    const StereoFrame frame = *std::exchange(waiting_, std::nullopt);
    lock.unlock();
    look_at(frame, detector);
    lock.lock();
  }
}

void BoardWatch::look_at(const StereoFrame& frame, BoardDetector& detector) {
  for (int k = 0; k < static_cast<int>(frame.images.size()); ++k) {
    const std::shared_ptr<const Image>& image = frame.image(k);
    if (!image) continue;
    const BoardDetection seen = detector.find(image->view());
    bool try_mirrored = false;
    {
      const std::lock_guard lock(mutex_);
      try_mirrored = seen.tags == 0 && mirror_tries_ < kMirrorTries;
      mirror_tries_ += try_mirrored;
    }
    const bool mirrored = try_mirrored && detector.finds_mirrored(image->view());
    const Time t = frame.t + frame.offsets.of(k);
    const std::lock_guard lock(mutex_);
    ++look_.images;
    recent_views_.add(k, t, image->width(), seen, mirrored);
    recorded_.detections.sizes.emplace(k, ImageSize{image->width(), image->height()});
    if (static_cast<int>(look_.cameras.size()) <= k) look_.cameras.resize(static_cast<std::size_t>(k) + 1);
    if (Picture& picture = look_.cameras[static_cast<std::size_t>(k)]; !picture.image || picture.t < t)
      picture = {t, image, seen.corners};
    if (!seen.corners.empty()) recorded_.detections.views.push_back({t, k, seen.corners});
  }
}

BoardWatch::Recorded BoardWatch::recorded() const {
  Recorded out;
  {
    const std::lock_guard lock(mutex_);
    out = recorded_;
    out.now = recent_views_.now();
  }
  std::ranges::sort(out.detections.views,
                    [](const BoardView& a, const BoardView& b) { return a.t != b.t ? a.t < b.t : a.camera < b.camera; });
  return out;
}

BoardWatch::Look BoardWatch::look() const {
  const std::lock_guard lock(mutex_);
  Look out = look_;
  out.advice = recent_views_.advice();
  return out;
}

}  // namespace fbvins::app
