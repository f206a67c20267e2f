// SPDX-License-Identifier: Apache-2.0
// What the frontend gives the estimator, and the two values that are fed back.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "fbvins/core/fixed_list.hpp"
#include "fbvins/core/ids.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/aiding.hpp"
#include "fbvins/types/anchor.hpp"
#include "fbvins/types/by_camera.hpp"
#include "fbvins/types/gauge.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// A stereo image with the IMU readings since the image before it.
struct SensorPacket {
  FrameId id;
  StereoFrame frame;
  ImuSegment imu;
  std::vector<Anchor> anchors = {};       ///< that came since the image before, of any stamp
  std::vector<AidingSample> aiding = {};  ///< since the image before
};

/// Where a feature is seen in one camera.
struct Observation {
  Vec2 pixel = Vec2::Zero();       ///< in the raw (distorted) image, px
  Vec2 normalised = Vec2::Zero();  ///< x/z, y/z of the undistorted ray in that camera's frame
  /// d(pixel)/d(normalised) at this point, divided by the standard deviation of the pixel position:
  /// weighs a residual in normalised coordinates so that it counts in sigmas of the raw image.
  Mat2 sqrt_information = Mat2::Identity();
  int camera = 0;  ///< of the rig, by number
  // Filled by the estimator, where not all is seen at the frame's stamp (docs/derivations/rolling_shutter.md):
  double rows = 0;              ///< of a rolling shutter, below the middle row, whose time is the camera's stamp
  double after_s = 0;           ///< when it was seen, after the frame's stamp
  Vec3 lever_B = Vec3::Zero();  ///< how far from its place at the stamp the camera was then, without the velocity's part, m
  /// Whole, of a body with this velocity at the stamp, m/s.
  Vec3 displacement_B(const Vec3& v_B) const { return lever_B + after_s * v_B; }
};

/// A feature in the newest frame, seen by at least one camera, by any cameras of the rig. It keeps its id, and its lead, as long
/// as it is followed.
struct TrackedFeature {
  TrackId id;
  int age_frames = 0;  ///< 0 when detected in this frame
  int lead = 0;        ///< the camera that it is followed in, and matched from in others; it may deliver no images
  /// One of a camera at most, the lead's first.
  FixedList<Observation, kMostCameras> seen = {};

  /// By a camera; null where it does not see the feature.
  const Observation* by(int camera) const {
    const auto it = std::find_if(seen.begin(), seen.end(), [&](const Observation& o) { return o.camera == camera; });
    return it == seen.end() ? nullptr : it;
  }
  Observation* by(int camera) { return const_cast<Observation*>(std::as_const(*this).by(camera)); }
  const Observation* left() const { return by(0); }
  const Observation* right() const { return by(1); }
  bool by_several() const { return seen.size() >= 2; }

  /// It is seen by this camera, instead of what was known of that.
  void see(int camera, const Observation& observation);
  /// Nothing where there is none.
  void see(int camera, const std::optional<Observation>& observation) {
    if (observation) see(camera, *observation);
  }
  void forget(int camera) {
    seen.erase_if([&](const Observation& o) { return o.camera == camera; });
  }
};

inline void TrackedFeature::see(int camera, const Observation& observation) {
  forget(camera);
  Observation& added = camera == lead ? seen.push_front(observation) : seen.push_back(observation);
  added.camera = camera;
}

/// Matches of tracks by descriptor, and how many agree with the verified position of the track.
struct DescriptorMatchCounts {
  int found = 0, inliers = 0;
  DescriptorMatchCounts& operator+=(const DescriptorMatchCounts& other) {
    found += other.found, inliers += other.inliers;
    return *this;
  }
};

struct FrontendStats {
  int tracked = 0;        ///< features continued from the frame before
  int detected = 0;       ///< new features
  int stereo = 0;         ///< features seen by several cameras
  int lost_flow = 0;      ///< lost by the tracker or matcher
  int lost_check = 0;     ///< lost by the forward-backward, ratio or mutual check, or found on a moving thing
  int lost_epipolar = 0;  ///< lost by RANSAC on the epipolar constraint
  int expected = 0;       ///< landmarks that were out of view and that this image should show
  int recognised = 0;     ///< of these, re-observed: tracked again under their old id
  double mean_brightness_left = 0;
  double mean_brightness_right = 0;
  /// Of the features continued, in the raw left image: `klt` from image to image, `orb` and `boost` from where they were
  /// predicted.
  double median_motion_px = 0;
  double pyramid_ms = 0, track_ms = 0, stereo_ms = 0, detect_ms = 0, geometry_ms = 0;
  DescriptorMatchCounts matches;      ///< over time, by the descriptors in use, of tracks that alignment has lost
  DescriptorMatchCounts raw_matches;  ///< what they would have found as extracted
  double boost_ms = 0;                ///< improving descriptors; part of detect_ms and track_ms
  double total_ms() const { return pyramid_ms + track_ms + stereo_ms + detect_ms + geometry_ms; }
};

struct TrackedFrame {
  FrameId id;
  Time t;
  std::vector<TrackedFeature> features;
  std::vector<bool> cameras = {};  ///< of which a usable image came; one that is missing at the end has none
  ImuSegment imu;                  ///< since the frame before
  FrontendStats stats;
  StereoFrame images;                            ///< null unless keyframes are wanted, which carry the images
  std::shared_ptr<const DepthImage> depth = {};  ///< of a rig with a depth sensor
  ExposureOffsets offsets = {};                  ///< of the cameras' images; filled by the system
  std::vector<Anchor> anchors = {};              ///< for the map
  std::vector<AidingSample> aiding = {};         ///< since the image before; filled by the system
  bool after_clock_step = false;                 ///< as in StereoFrame; filled by the system

  /// Whether a usable image of the camera came.
  bool has(int camera) const {
    const auto at = static_cast<std::size_t>(camera);
    return at < cameras.size() && cameras[at];
  }
  void set_has(int camera, bool came) {
    const auto at = static_cast<std::size_t>(camera);
    if (at >= cameras.size()) cameras.resize(at + 1);
    cameras[at] = came;
  }
};

/// A landmark with its last estimated position.
struct LocatedLandmark {
  TrackId track;
  Vec3 p_G = Vec3::Zero();  ///< m
};

/// Positions of the landmarks that left the window with one frame. A message apart from StatePrior, because a state may
/// be skipped and a position must not: updates are numbered without gaps, and each is delivered once, in order.
struct LandmarkUpdate {
  std::int64_t sequence = 0;        ///< counts from 0
  std::uint32_t reset_counter = 0;  ///< a new value: earlier positions are void (G is a new frame, or they no longer fit in it)
  std::vector<LocatedLandmark> landmarks;
};

/// The newest estimate, fed back to the frontend for guided matching; one may be skipped. It is in the window's own frame G,
/// which is never levelled: `gravity_G` gives the vertical.
struct StatePrior {
  Time t;
  Pose<G, B> T_GB;
  Vec3 v_GB = Vec3::Zero();  ///< m/s, in G
  ImuBias bias;
  Vec3 gravity_G = Vec3(0, 0, -9.81);  ///< m/s^2
  bool valid = false;
  Duration time_offset = {};  ///< what the rig's is corrected by; also before the first start
};

}  // namespace fbvins
