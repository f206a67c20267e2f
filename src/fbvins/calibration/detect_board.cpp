// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/detect_board.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <thread>

#include "fbvins/calibration/board_detector.hpp"
#include "fbvins/io/image_decode.hpp"

namespace fbvins {
namespace {

constexpr int kMirrorTries = 40;  ///< images without a tag that are looked at mirrored

/// What one image gave.
struct Looked {
  BoardView view;
  ImageSize size;
  int tags = 0, foreign_tags = 0, twice = 0;
  bool mirrored = false;
  std::string problem = {};  ///< it could not be read
};

Looked look(const TakenImage& taken, BoardDetector& detector, bool try_mirrored) {
  Looked out{{taken.t, taken.camera, {}}, {}};
  std::shared_ptr<const Image> image = taken.image;
  if (!image) {
    Result<Image> decoded =
        taken.bytes.empty() ? Result<Image>(Error{ErrorCode::unreadable, "cannot be read"}) : decode_image(taken.bytes);
    if (!decoded) {
      out.problem = fmt::format("{}: {}", taken.name, decoded.error().message);
      return out;
    }
    image = std::make_shared<const Image>(*std::move(decoded));
  }
  out.size = {image->width(), image->height()};
  BoardSighting seen = detector.find(image->view());
  out.view.corners = std::move(seen.corners);
  out.tags = seen.tags;
  out.foreign_tags = seen.foreign_tags;
  out.twice = seen.twice;
  out.mirrored = try_mirrored && seen.tags == 0 && detector.finds_mirrored(image->view());
  return out;
}

/// Images are handed out, and their results kept, under one lock.
class Search {
 public:
  Search(const std::function<std::optional<TakenImage>()>& next, const BoardSearchOptions& options)
      : next_(next), options_(options) {}

  void work(BoardDetector& detector) {
    while (true) {
      std::unique_lock lock(mutex_);
      std::optional<TakenImage> taken = next_();
      if (!taken) return;
      const std::size_t index = results_.size();
      results_.emplace_back();
      lock.unlock();
      Looked looked = look(*taken, detector, index % 10 == 0 && index < 10 * kMirrorTries);
      lock.lock();
      results_[index] = std::move(looked);
      if (options_.progress) options_.progress(++done_);
    }
  }

  std::vector<Looked>& results() { return results_; }

 private:
  const std::function<std::optional<TakenImage>()>& next_;
  const BoardSearchOptions& options_;
  std::mutex mutex_;
  std::vector<Looked> results_;
  int done_ = 0;
};

Result<void> add(Looked& looked, BoardSearch& out) {
  if (!looked.problem.empty()) {
    if (out.unreadable++ == 0) out.first_unreadable = looked.problem;
    return {};
  }
  const int camera = looked.view.camera;
  if (static_cast<int>(out.images.size()) <= camera) out.images.resize(camera + 1, 0);
  ++out.images[camera];
  const auto known = out.detections.sizes.emplace(camera, looked.size).first;
  if (known->second != looked.size)
    return Error{ErrorCode::malformed,
                 fmt::format("cam{}'s images are {} x {} and {} x {}: all must have one size", camera, known->second.width,
                             known->second.height, looked.size.width, looked.size.height)};
  if (!looked.view.corners.empty()) out.detections.views.push_back(std::move(looked.view));
  return {};
}

/// Why a board was not found, or not one board.
Result<void> judge(const std::vector<Looked>& results, const Board& board) {
  int with_tags = 0, twice = 0, foreign = 0, mirrored = 0, readable = 0;
  for (const Looked& looked : results) {
    readable += looked.problem.empty();
    with_tags += looked.tags > 0;
    twice += looked.twice > 0;
    foreign += looked.foreign_tags > looked.tags;
    mirrored += looked.mirrored;
  }
  const auto refused = [](std::string sentence) { return Error{ErrorCode::invalid_argument, std::move(sentence)}; };
  if (readable == 0) return refused("no image of the recording could be read");
  if (mirrored > 0 && with_tags <= mirrored)
    return refused(
        "the tags are found only in mirrored images: the board was printed mirrored, or the camera mirrors its images");
  if (foreign > with_tags / 2 && foreign > 0)
    return refused(fmt::format(
        "most tags have numbers that the target file's board ({}) does not have: it describes another board", board.describe()));
  if (twice > with_tags / 10 && twice > 1)
    return refused(fmt::format("a tag is there twice in {} images: only one board may be in view", twice));
  if (with_tags == 0) return refused(fmt::format("no tag of tag36h11 was found in {} images", readable));
  return {};
}

}  // namespace

Result<BoardSearch> detect_board(const Board& board, const std::function<std::optional<TakenImage>()>& next,
                                 const BoardSearchOptions& options) {
  std::vector<BoardDetector> detectors;
  for (int i = 0; i < std::max(1, options.threads); ++i) {
    Result<BoardDetector> detector = BoardDetector::create(board);
    if (!detector) return detector.error();
    detectors.push_back(*std::move(detector));
  }
  Search search(next, options);
  std::vector<std::thread> threads;
  for (std::size_t i = 1; i < detectors.size(); ++i) threads.emplace_back([&, i] { search.work(detectors[i]); });
  search.work(detectors[0]);
  for (std::thread& thread : threads) thread.join();
  if (Result<void> good = judge(search.results(), board); !good) return good.error();
  BoardSearch out;
  for (Looked& looked : search.results())
    if (Result<void> good = add(looked, out); !good) return good.error();
  std::ranges::stable_sort(out.detections.views,
                           [](const BoardView& a, const BoardView& b) { return a.t != b.t ? a.t < b.t : a.camera < b.camera; });
  return out;
}

}  // namespace fbvins
