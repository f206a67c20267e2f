// SPDX-License-Identifier: Apache-2.0
// A stereo-inertial recording as a stream of events. One thread uses a Dataset; images are decoded
// ahead on a thread of its own, which changes nothing in what is delivered.
//
//   Result<std::unique_ptr<Dataset>> opened = open_dataset("MH_01_easy.zip");
//   if (!opened) { report(opened.error().message); return 1; }
//   Dataset& data = **opened;
//   while (auto event = data.next()) system.push(std::move(*event));
//
// Order: every IMU sample up to the first one at or after an image (stamp + time offset), the readings of
// aiding sensors (types/aiding.hpp) up to it, then the
// image. After the last image the remaining samples, unless max_frames or duration_s cut the recording short. A flight record
// comes in the order in which it was recorded.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/io/dataset_info.hpp"
#include "fbvins/io/trajectory.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

struct DatasetOptions {
  int skip_frames = 0;                ///< stereo frames left out at the start
  int max_frames = 0;                 ///< 0: all
  double start_s = 0;                 ///< stereo frames stamped less than this after the first one are left out
  double duration_s = 0;              ///< those stamped this much or more after start_s, too; 0: none
  double pair_tolerance_ms = 3.0;     ///< stamps of left and right may differ by this
  int prefetch_frames = 4;            ///< decoded ahead; 0: decode when asked, without a thread
  bool require_imu = true;            ///< false: a recording without imu0 is fine
  std::string kalibr_camchain = "";   ///< replaces the recording's own calibration
  std::string kalibr_imu = "";        ///< replaces its IMU's noise and axes
  std::optional<StereoRig> rig = {};  ///< replaces both
  bool scale_lenses = false;          ///< where images are larger or smaller than the calibration's, but of the same shape
  std::string camera = "all";         ///< or the first two: "both", or one of these: "left", "right"; the left one with "depth"

  /// Whether the recording's own calibration is replaced.
  bool brings_rig() const { return rig || !kalibr_camchain.empty(); }

  template <class V>
  void visit(V&& v) {
    v("skip_frames", skip_frames, "", "stereo frames left out at the start", 0, 1'000'000'000);
    v("max_frames", max_frames, "", "stereo frames delivered at most, 0 for all", 0, 1'000'000'000);
    v("start_s", start_s, "s", "what comes before, counted from the first stereo frame, is left out", 0.0, 1e9);
    v("duration_s", duration_s, "s", "what comes later, counted from start_s, is left out; 0: nothing", 0.0, 1e9);
    v("pair_tolerance_ms", pair_tolerance_ms, "ms", "largest difference of the stamps of left and right", 0.0, 1000.0);
    v("prefetch_frames", prefetch_frames, "", "stereo frames decoded ahead on another thread", 0, 1000);
    v("require_imu", require_imu, "", "refuse recordings without IMU");
    v("kalibr_camchain", kalibr_camchain, "", "camchain-imucam.yaml that replaces the recording's calibration");
    v("kalibr_imu", kalibr_imu, "", "imu.yaml that replaces noise and axes of the recording's IMU");
    v("camera", camera, "all|both|left|right|depth",
      "the cameras that are used: all, the first two, one of these, or the left one with its depth images");
  }
};

/// One stereo frame as listed, before its images are read.
struct FrameEntry {
  Time t;
  /// Of each camera, as the loader names it; empty, or missing at the end: no image. All empty: recorded without any.
  std::vector<std::string> files = {};
  std::optional<std::size_t> imu_before = {};  ///< how many IMU samples come before it; none: stamps decide
  std::string depth_file = {};                 ///< of the depth sensor
  ExposureOffsets offsets = {};                ///< of cameras without a common trigger

  std::string& file(int camera) { return of_camera(files, camera); }
  const std::string& file(int camera) const { return of_camera(files, camera); }
  bool without_images() const { return std::ranges::all_of(files, &std::string::empty); }
};

/// One stereo frame as read.
struct LoadedFrame {
  StereoFrame frame;
  std::vector<ImageCounts> cameras;     ///< what happened, 0 or 1 for each image
  ImageCounts depth;                    ///< the same of the depth image
  std::string problem;                  ///< "file: sentence" about the first image that failed
  std::optional<ImageSize> other_size;  ///< of the last image that is not of its camera's

  ImageCounts& of(int camera) { return of_camera(cameras, camera); }
};

/// Where a Dataset gets its images from. Called by one thread at a time, not always the same.
class FrameLoader {
 public:
  virtual ~FrameLoader() = default;
  virtual LoadedFrame load(const FrameEntry& entry) = 0;
};

/// Everything a format's reader finds out.
struct DatasetContents {
  StereoRig rig;
  DatasetInfo info;
  std::vector<TrajectoryPoint> ground_truth;
  std::vector<ImuSample> imu;             ///< increasing stamps; in the order recorded where frames have imu_before
  std::vector<FrameEntry> frames;         ///< the same
  std::vector<AidingSample> aiding = {};  ///< increasing stamps, on the IMU's clock
  std::unique_ptr<FrameLoader> loader = {};
};

/// The error where a recording of depth images was asked for that has none.
Error no_depth_images(const std::string& path);

class FramePrefetcher;

class Dataset {
 public:
  Dataset(DatasetContents contents, const DatasetOptions& options);
  ~Dataset();
  Dataset(const Dataset&) = delete;
  Dataset& operator=(const Dataset&) = delete;

  const StereoRig& rig() const { return contents_.rig; }
  /// Counts of image files grow while frames are delivered.
  const DatasetInfo& info() const { return contents_.info; }
  bool has_ground_truth() const { return !contents_.ground_truth.empty(); }
  const std::vector<TrajectoryPoint>& ground_truth() const { return contents_.ground_truth; }
  const std::vector<FrameEntry>& frames() const { return contents_.frames; }

  /// Whether next() has been called, and whether it has come to the end: a recording is read once.
  bool begun() const { return begun_; }
  bool at_end() const { return at_end_; }

  /// The next event, nullopt at the end.
  std::optional<SensorEvent> next();

 private:
  bool imu_is_due() const;
  std::optional<AidingSample> due_aiding();
  std::optional<StereoFrame> next_frame();
  void count(const LoadedFrame& loaded);

  DatasetContents contents_;
  std::unique_ptr<FramePrefetcher> prefetcher_;
  bool deliver_rest_ = true;  ///< IMU samples after the last image
  std::size_t next_imu_ = 0;
  std::size_t next_frame_ = 0;
  std::size_t next_aiding_ = 0;
  std::size_t next_clock_step_ = 0;
  bool begun_ = false, at_end_ = false;
};

Result<std::unique_ptr<Dataset>> open_dataset(const std::string& path, const DatasetOptions& options = {});

}  // namespace fbvins
