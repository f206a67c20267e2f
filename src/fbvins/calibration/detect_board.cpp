// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/detect_board.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "fbvins/calibration/board_detector.hpp"
#include "fbvins/calibration/kept_detections.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

constexpr int kMirrorTries = 40;  ///< images that are looked at mirrored if they show no tag
constexpr int kMirrorStep = 11;   ///< every so many, so that each of up to eight cameras has its share

ImageFinding look(const ListedImage& listed, const CameraRecording::Decode& decode, BoardDetector& detector, bool try_mirrored) {
  ImageFinding out{{listed.t, listed.camera, {}}, {}};
  const Result<Image> image = decode();
  if (!image) {
    out.problem = printable(fmt::format("{}: {}", listed.name, image.error().message));
    return out;
  }
  out.size = {image->width(), image->height()};
  BoardDetection seen = detector.find(image->view());
  out.view.corners = std::move(seen.corners);
  out.tags = seen.tags;
  out.foreign_tags = seen.foreign_tags;
  out.twice = seen.twice;
  out.mirrored = try_mirrored && seen.tags == 0 && detector.finds_mirrored(image->view());
  return out;
}

bool tried_mirrored(std::size_t index) { return index % kMirrorStep == 0 && index < kMirrorStep * kMirrorTries; }

/// Images are handed out, and their findings kept, under one lock.
class Search {
 public:
  Search(const Board& board, const CameraRecording& recording, const BoardSearchOptions& options)
      : recording_(recording), options_(options), found_(recording.images.size()) {
    if (!options.keep.empty()) kept_.emplace(options.keep, board, recording.images);
  }

  /// Takes up what was kept, if the first image that shows the board still gives the same.
  void resume(BoardDetector& detector) {
    if (!kept_) return;
    ImageFindings known = kept_->read();
    for (std::optional<ImageFinding>& finding : known)
      if (finding && !finding->problem.empty()) finding.reset();  // perhaps it can be read now
    const auto shown = std::ranges::find_if(known, [](const auto& finding) { return finding && !finding->view.corners.empty(); });
    if (shown == known.end()) return;
    if (const auto index = static_cast<std::size_t>(shown - known.begin()); look_at(index, detector) != **shown)
      return kept_->forget();
    found_ = std::move(known);
    done_ = static_cast<int>(std::ranges::count_if(found_, [](const auto& finding) { return finding.has_value(); }));
    if (options_.resumed) options_.resumed(done_);
  }

  void work(BoardDetector& detector) {
    std::unique_lock lock(mutex_);
    while (failure_.ok() && !stopped_) {
      while (next_ < found_.size() && found_[next_]) ++next_;
      if (next_ == found_.size()) return;
      if (options_.stop && options_.stop()) {
        stopped_ = true;
        return;
      }
      const std::size_t index = next_++;
      const CameraRecording::Decode decode = recording_.take(index);
      lock.unlock();
      ImageFinding finding = look(recording_.images[index], decode, detector, tried_mirrored(index));
      lock.lock();
      found_[index] = std::move(finding);
      keep_if_complete(index / KeptDetections::kImagesOfPart);
      ++done_;
      if (options_.progress) options_.progress(done_);
    }
  }

  ImageFindings& found() { return found_; }
  const Result<void>& failure() const { return failure_; }
  bool stopped() const { return stopped_; }
  int done() const { return done_; }

 private:
  ImageFinding look_at(std::size_t index, BoardDetector& detector) const {
    return look(recording_.images[index], recording_.take(index), detector, tried_mirrored(index));
  }

  void keep_if_complete(std::size_t part) {
    if (!kept_) return;
    const std::size_t first = part * KeptDetections::kImagesOfPart;
    const std::size_t end = std::min(found_.size(), first + KeptDetections::kImagesOfPart);
    for (std::size_t i = first; i < end; ++i)
      if (!found_[i]) return;
    if (Result<void> kept = kept_->keep(part, found_); !kept && failure_) failure_ = kept;
  }

  const CameraRecording& recording_;
  const BoardSearchOptions& options_;
  std::optional<KeptDetections> kept_;
  std::mutex mutex_;
  ImageFindings found_;
  std::size_t next_ = 0;
  int done_ = 0;
  bool stopped_ = false;
  Result<void> failure_;
};

Result<void> add(ImageFinding& looked, BoardSearch& out) {
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

/// The camera whose tags are found in mirrored images only; -1: none.
int mirrored_camera(const ImageFindings& found) {
  std::map<int, std::pair<int, int>> cameras;  // with tags, mirrored
  for (const std::optional<ImageFinding>& looked : found) {
    auto& [with_tags, mirrored] = cameras[looked->view.camera];
    with_tags += looked->tags > 0, mirrored += looked->mirrored;
  }
  for (const auto& [camera, counts] : cameras)
    if (counts.second > 0 && counts.first <= counts.second) return camera;
  return -1;
}

/// Why a board was not found, or not one board.
Result<void> judge(const ImageFindings& found, const Board& board) {
  int with_tags = 0, twice = 0, foreign = 0, readable = 0;
  for (const std::optional<ImageFinding>& looked : found) {
    readable += looked->problem.empty();
    with_tags += looked->tags > 0;
    twice += looked->twice > 0;
    foreign += looked->foreign_tags > looked->tags;
  }
  const auto refused = [](std::string sentence) { return Error{ErrorCode::invalid_argument, std::move(sentence)}; };
  if (readable == 0) return refused("no image of the recording could be read");
  if (const int camera = mirrored_camera(found); camera >= 0)
    return refused(fmt::format(
        "the tags are found only where the images of cam{} are mirrored: the board was printed mirrored, or the camera "
        "mirrors its images",
        camera));
  if (foreign > with_tags / 2 && foreign > 0)
    return refused(fmt::format(
        "most tags have numbers that the target file's board ({}) does not have: it describes another board", board.describe()));
  if (twice > with_tags / 10 && twice > 1)
    return refused(fmt::format("a tag is there twice in {} images: only one board may be in view", twice));
  if (with_tags == 0) return refused(fmt::format("no tag of tag36h11 was found in {} images", readable));
  return {};
}

}  // namespace

Result<BoardSearch> detect_board(const Board& board, const CameraRecording& recording, const BoardSearchOptions& options) {
  std::vector<BoardDetector> detectors;
  for (int i = 0; i < std::max(1, options.threads); ++i) {
    Result<BoardDetector> detector = BoardDetector::create(board);
    if (!detector) return detector.error();
    detectors.push_back(*std::move(detector));
  }
  Search search(board, recording, options);
  search.resume(detectors[0]);
  std::vector<std::thread> threads;
  for (std::size_t i = 1; i < detectors.size(); ++i) threads.emplace_back([&, i] { search.work(detectors[i]); });
  search.work(detectors[0]);
  for (std::thread& thread : threads) thread.join();
  if (!search.failure()) return search.failure().error();
  BoardSearch out;
  if (search.stopped()) {
    out.stopped_after = search.done();
    return out;
  }
  if (Result<void> good = judge(search.found(), board); !good) return good.error();
  for (std::optional<ImageFinding>& looked : search.found())
    if (Result<void> good = add(*looked, out); !good) return good.error();
  std::ranges::stable_sort(out.detections.views,
                           [](const BoardView& a, const BoardView& b) { return a.t != b.t ? a.t < b.t : a.camera < b.camera; });
  return out;
}

}  // namespace fbvins
