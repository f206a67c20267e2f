// SPDX-License-Identifier: Apache-2.0
// Joins the images of separate camera streams, and of a depth sensor's, to frames by their stamps.
//
//   FrameJoiner joiner(4);
//   joiner.add(2, t, image);
//   while (auto frame = joiner.next()) input.push(*std::move(frame));
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "fbvins/core/sample_period.hpp"
#include "fbvins/types/image.hpp"

namespace fbvins {

/// Frames are delivered in order of time; an image that comes when its frame has been delivered is dropped. A frame is delivered
/// without a camera's image when that image counts as lost: that camera has delivered a newer one, or another camera has
/// delivered several since. For a silent camera no frame waits; with its next image but one, at the latest, it is there again
/// (silence is measured by the newest stamp of any camera). A camera whose images never meet those of camera 0 has no common
/// trigger with it: then each frame has the image of it that is nearest to a quarter of an interval before, with its offset. A
/// depth image without any camera's is dropped, and so are images of other cameras that are too far
/// from one of camera 0 to be its partner, and nearer than half an interval: as recordings are paired (pair_frames()). One thread
/// at a time.
class FrameJoiner {
 public:
  /// `tolerance`: by which the stamps of a frame's images may differ; the default is that of recordings. `own`: how long after
  /// their stamps the cameras take their images, by the calibration (own_offsets()). Images are joined by when they were taken;
  /// the offsets of frames are of the stamps.
  explicit FrameJoiner(int cameras, bool depth = false, Duration tolerance = Duration{3'000'000}, ExposureOffsets own = {})
      : cameras_(cameras), tolerance_(tolerance), own_(std::move(own)), streams_(static_cast<std::size_t>(cameras + depth)) {}

  /// Stamps of one camera ascend; one that does not is dropped. After it, next() until that is empty.
  void add(int camera, Time t, std::shared_ptr<const Image> image) { put(static_cast<std::size_t>(camera), t, std::move(image)); }
  /// Of the depth sensor that is registered to camera 0.
  void add_depth(Time t, std::shared_ptr<const DepthImage> depth) { put(streams_.size() - 1, t, std::move(depth)); }
  std::optional<StereoFrame> next();
  bool without_trigger(int camera) const { return is_free(streams_[static_cast<std::size_t>(camera)]); }
  /// Frames that left with the images of some cameras only, and images that were dropped, in one sentence; empty: there are none.
  std::string report() const;

 private:
  static constexpr int kApart = 20;  // images in a row that leave without one of camera 0, while both deliver
  using Pixels = std::variant<std::shared_ptr<const Image>, std::shared_ptr<const DepthImage>>;
  struct Waiting {
    Time t;
    Pixels pixels;
  };
  struct Stream {
    std::deque<Waiting> waiting;
    std::optional<Time> newest = {};
    Duration interval = {}, before = {};  // the last one, and that before it
    SamplePeriod period = {};
    Duration lag = {};  // how much older than others' images they are when they come: the most of late, fading
    int apart = 0;
  };

  static bool is_free(const Stream& stream) { return stream.apart >= kApart; }
  void put(std::size_t stream, Time stamp, Pixels pixels);
  bool is_silent(const Stream& stream) const;
  std::optional<Time> first_waiting() const;
  bool is_complete(Time first) const;
  bool free_ones_are_there(Time t) const;
  void count_apart(Time first);
  void take_first(std::size_t stream, StereoFrame& frame);
  void take_nearest(std::size_t stream, StereoFrame& frame);
  std::optional<StereoFrame> of_a_free_one();
  bool are_one_instant(Time a, Time b) const;
  bool is_stray(const StereoFrame& frame) const;
  StereoFrame counted(StereoFrame frame);
  StereoFrame join(Time first);
  std::optional<StereoFrame> next_by_exposure();

  int cameras_;
  Duration tolerance_;
  ExposureOffsets own_;
  std::optional<Time> began_, now_, delivered_;
  std::int64_t whole_ = 0, parts_ = 0, dropped_ = 0;  // frames, and frames of images that were dropped
  std::optional<Time> last_zero_;                     // the newest frame with an image of camera 0
  std::vector<Stream> streams_;                       // of the cameras, and of the depth sensor at the end
};

}  // namespace fbvins
