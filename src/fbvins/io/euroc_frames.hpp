// SPDX-License-Identifier: Apache-2.0
// Private to io: rows of EuRoC's CSV files, pairing of left and right images, and loading them.
#pragma once

#include "fbvins/io/csv.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {

/// A row of camN/data.csv.
struct ImageRow {
  Time t;
  std::string file;  ///< below camN/data/
};
ParsedRows<ImageRow> parse_image_rows(std::string_view csv, const std::string& file);
Result<StampedRows<ImageRow>> read_image_rows(std::string_view csv, const std::string& file);

/// A row of imu0/data.csv: stamp, gyro xyz, accelerometer xyz.
class ImuRowParser {
 public:
  RowVerdict operator()(std::string_view line, ImuSample& sample, std::string& problem);

 private:
  std::vector<std::string_view> fields_;
};

struct PairedFrames {
  std::vector<FrameEntry> frames;     ///< in order of time
  int left_only = 0, right_only = 0;  ///< images without a partner
  bool untriggered = false;           ///< the cameras have no common trigger: offsets say when the right images were taken
};

/// Each left image with the nearest right one within the tolerance (at most half the median interval). A right image farther
/// than half the interval from all left ones, where those are missing, is a frame of its own; one that is nearer is left out.
/// Where more than a third of the left images have no partner within the tolerance but one within an interval, the cameras have
/// no common trigger: then each left image has the right one that is nearest to a quarter of the interval before it.
PairedFrames pair_frames(const std::vector<ImageRow>& left, const std::vector<ImageRow>& right, Duration tolerance);

/// What is said of cameras without a common trigger: `camera` and camera 0.
std::string untriggered_sentence(const std::vector<FrameEntry>& frames, int camera, double tolerance_ms);

/// Adds the images of a further camera, from number 2 on: each to the nearest frame within the tolerance (at most
/// half the median interval), or, farther than half the interval from all, as a frame of its own; without a common trigger as in
/// pair_frames. Returns how many had no partner.
int add_camera(std::vector<FrameEntry>& frames, const std::vector<ImageRow>& images, int camera, Duration tolerance);

/// Gives each depth image to the nearest frame within the tolerance. Returns how many had none.
int add_depth(std::vector<FrameEntry>& frames, const std::vector<ImageRow>& images, Duration tolerance);

/// The frames of the images of one or more cameras, and of a depth sensor, if there is one; each list is in order of time. Images
/// are joined by when they were taken, `own` after their stamps (own_offsets()); the frames' offsets are of their stamps. In
/// `info` it says how many are without a partner, with warnings; where no image of camera 0 has one, or no depth image has, the
/// recording is none of these cameras.
std::vector<FrameEntry> join_images(std::vector<std::vector<ImageRow>> cameras, const std::vector<ImageRow>& depth,
                                    const ExposureOffsets& own, double tolerance_ms, DatasetInfo& info);

struct Intervals {
  Duration median, longest;
  Time longest_start;
  double rate_hz = 0;  ///< one over the median; 0 for fewer than two stamps
};
Intervals measure_intervals(const std::vector<Time>& increasing);

/// Where depth images are, with a slash at the end.
inline constexpr std::string_view kDepthFolder = "depth0/";

/// `folders`: of the rig's cameras, in their order, with a slash at the end; twice the same where its images have both side by
/// side. Images of 16 bits with values of fewer are scaled, which `info` says.
std::unique_ptr<FrameLoader> make_euroc_loader(std::unique_ptr<FileSource> files, const std::string& root,
                                               std::vector<std::string> folders, const StereoRig& rig,
                                               const std::vector<FrameEntry>& frames, DatasetInfo& info);

}  // namespace fbvins
