// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/dataset.hpp"

#include <fmt/format.h>

#include "fbvins/core/options.hpp"
#include "fbvins/io/dataset_description.hpp"
#include "fbvins/io/euroc.hpp"
#include "fbvins/io/frame_prefetcher.hpp"
#include "fbvins/io/image_check.hpp"
#include "fbvins/io/mcap_dataset.hpp"

namespace fbvins {
namespace {

/// One of two cameras, which is the left one then.
class OneCamera : public FrameLoader {
 public:
  OneCamera(std::unique_ptr<FrameLoader> both, bool right) : both_(std::move(both)), right_(right) {}

  LoadedFrame load(const FrameEntry& entry) override {
    if (!right_) return both_->load(entry);
    FrameEntry one = entry;  // whose only file is the camera's
    one.files.insert(one.files.begin(), "");
    LoadedFrame out = both_->load(one);
    out.frame.swap_left_right();
    out.cameras = {out.of(1)};
    return out;
  }

 private:
  std::unique_ptr<FrameLoader> both_;
  bool right_;
};

DatasetContents with_cameras(DatasetContents contents, const std::string& camera) {
  if (camera == "left" && contents.rig.depth) {
    contents.rig.depth.reset();
    contents.rig = with_one_camera(contents.rig);
    contents.info.depth = {};
    for (FrameEntry& frame : contents.frames) frame.depth_file.clear();
  }
  if (camera == "all" || camera == "depth" || !contents.rig.has_right()) return contents;
  contents.rig.cameras.resize(2);
  contents.info.cameras.resize(2);
  for (FrameEntry& frame : contents.frames) frame.files.resize(2);
  if (camera == "both") {
    std::erase_if(contents.frames, [](const FrameEntry& frame) { return frame.without_images(); });
    return contents;
  }
  const bool right = camera == "right";
  contents.rig = with_one_camera(contents.rig, right);
  for (FrameEntry& frame : contents.frames) {
    frame.files = {frame.files[right ? 1 : 0]};
    if (right) frame.t = frame.t + frame.offsets.of(1);
    frame.offsets = {};
  }
  std::erase_if(contents.frames, [](const FrameEntry& frame) { return frame.without_images(); });
  contents.info.cameras = {contents.info.cameras[right ? 1 : 0]};
  contents.loader = std::make_unique<OneCamera>(std::move(contents.loader), right);
  return contents;
}

Result<DatasetContents> contents_of(const std::string& path, const DatasetOptions& options) {
  return is_mcap(path) ? open_mcap(path, options) : open_euroc(path, options);
}

}  // namespace

Dataset::Dataset(DatasetContents contents, const DatasetOptions& options)
    : contents_(with_cameras(std::move(contents), options.camera)),
      prefetcher_(std::make_unique<FramePrefetcher>(contents_.frames, *contents_.loader, options.prefetch_frames)),
      deliver_rest_(options.max_frames == 0 && options.duration_s == 0) {
  warn_of_silent_cameras(contents_);
}

Dataset::~Dataset() = default;

std::optional<SensorEvent> Dataset::next() {
  begun_ = true;
  while (true) {
    if (imu_is_due()) return contents_.imu[next_imu_++];
    if (next_frame_ == contents_.frames.size()) {
      at_end_ = true;
      return std::nullopt;
    }
    if (const auto reading = due_aiding()) return *reading;
    auto frame = next_frame();
    if (!frame) continue;
    const std::vector<Time>& steps = contents_.info.clock_steps;
    for (; next_clock_step_ < steps.size() && steps[next_clock_step_] <= frame->t; ++next_clock_step_)
      frame->after_clock_step = true;
    return *std::move(frame);
  }
}

/// True until one sample at or after the next image, on the IMU's clock, has been delivered, or as many as the record says.
bool Dataset::imu_is_due() const {
  if (next_imu_ == contents_.imu.size()) return false;
  if (next_frame_ == contents_.frames.size()) return deliver_rest_;
  const FrameEntry& frame = contents_.frames[next_frame_];
  if (frame.imu_before) return next_imu_ < *frame.imu_before;
  const Time image = frame.t + Duration::from_seconds(contents_.rig.time_offset_s);
  return next_imu_ == 0 || contents_.imu[next_imu_ - 1].t < image;
}

/// On the images' clock.
std::optional<AidingSample> Dataset::due_aiding() {
  if (next_aiding_ == contents_.aiding.size()) return std::nullopt;
  AidingSample reading = contents_.aiding[next_aiding_];
  stamp_of(reading) = stamp_of(reading) - Duration::from_seconds(contents_.rig.time_offset_s);
  if (stamp_of(reading) > contents_.frames[next_frame_].t) return std::nullopt;
  ++next_aiding_;
  return reading;
}

/// Nullopt for a frame that lost all of its images, unless it was recorded without any.
std::optional<StereoFrame> Dataset::next_frame() {
  const FrameEntry& entry = contents_.frames[next_frame_++];
  std::optional<LoadedFrame> loaded = prefetcher_->next();
  if (entry.without_images()) return std::move(loaded->frame);
  count(*loaded);
  if (loaded->frame.without_images()) return std::nullopt;
  return std::move(loaded->frame);
}

void Dataset::count(const LoadedFrame& loaded) {
  DatasetInfo& info = contents_.info;
  ImageCounts now = loaded.depth;
  info.depth.images += loaded.depth;
  for (std::size_t i = 0; i < loaded.cameras.size(); ++i)
    info.camera(static_cast<int>(i)).images += loaded.cameras[i], now += loaded.cameras[i];
  if (loaded.frame.without_images()) ++info.frames_without_image;
  // One sentence for the first of them; the counts say how many.
  ImageCounts all = info.depth.images;
  for (const CameraInfo& camera : info.cameras) all += camera.images;
  if (now.bad() > 0 && all.corrupt + all.wrong_size == now.bad()) info.warnings.push_back(loaded.problem);
}

Error no_depth_images(const std::string& path) {
  return {ErrorCode::not_found, fmt::format("{}: --camera depth is given, and there are no depth images", path)};
}

Result<std::unique_ptr<Dataset>> open_dataset(const std::string& path, const DatasetOptions& options) {
  if (Result<void> valid = validate(options); !valid) return valid.error();
  Result<DatasetContents> contents = contents_of(path, options);
  if (!contents) return contents.error();
  if (const auto scaled = options.scale_lenses ? scaled_to_images(*contents) : std::nullopt) {
    DatasetOptions again = options;
    again.rig = scaled->rig;
    contents = contents_of(path, again);
    if (!contents) return contents.error();
    contents->info.scaled = scaled->cameras;
  }
  if (options.camera == "depth" && !contents->rig.depth) return no_depth_images(path);
  if (Result<void> readable = check_images(*contents); !readable) return readable.error();
  return std::make_unique<Dataset>(*std::move(contents), options);
}

}  // namespace fbvins
