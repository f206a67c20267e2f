// SPDX-License-Identifier: Apache-2.0
// The events that a live system sends to its sinks. Values; images are shared, not copied.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/geometry/pose.hpp"
#include "fbvins/types/aiding.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/imu.hpp"
#include "fbvins/types/loop.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

/// The body at an IMU reading: the newest estimate propagated to it; while the IMU is silent, at each image. Without a pose
/// (`health`) only times and health are valid.
struct LivePose {
  Time t;                                   ///< of the reading or image, on the images' clock
  Time host_t;                              ///< the same moment on this machine's CLOCK_MONOTONIC
  Time estimate_t;                          ///< of the image whose estimate was propagated
  Pose<W, B> T_WB;                          ///< converges to each new estimate without a step (LiveOptions::smoothing_s)
  Vec3 v_WB = Vec3::Zero();                 ///< m/s, in W
  Vec3 w_WB_B = Vec3::Zero();               ///< rad/s, in B, bias removed; zero while the IMU is silent
  Mat6 pose_covariance = Mat6::Zero();      ///< of (dp in W [m], dtheta in B [rad])
  Mat3 velocity_covariance = Mat3::Zero();  ///< of v_WB, m^2/s^2
  double tilt_sigma_rad = 0;                ///< that of the propagated estimate
  bool level = false;                       ///< likewise
  double scale_sigma = 0;                   ///< likewise, as in Odometry
  Health health;                            ///< the estimator's, or worse where sensors have been silent since
  std::uint32_t reset_counter = 0;          ///< +1 whenever W is a new frame
};

/// What became of the input since the start.
struct LiveCounts {
  std::int64_t imu = 0, images = 0;     ///< arrived
  std::int64_t images_estimated = 0;    ///< of these, with an answer of the estimator, a pose or not
  std::int64_t images_dropped = 0;      ///< because the stages were busy with older ones
  std::int64_t images_incomplete = 0;   ///< one camera missing or frozen
  std::int64_t images_late = 0;         ///< dropped: with a stamp before a newer image's, or one that no clock gives, or twice
  std::int64_t keyframes_left_out = 0;  ///< not in the map, because it was busy with older ones
  std::int64_t imu_refused = 0;         ///< not finite, beyond the sensor's range, or the same again and again
  std::int64_t imu_late = 0;            ///< dropped: a later one had gone on before, or the stamp is one that no clock gives
  std::int64_t imu_reordered = 0;       ///< came late, and were put in order
  std::int64_t clock_leaps = 0;         ///< jumps of a sensor's clock, corrected
  std::int64_t clock_set_back = 0;      ///< of these, back to a time that says nothing: the estimate began anew
  std::int64_t resets = 0;              ///< restarts of the estimator
  std::int64_t events_lost = 0;         ///< events that sinks did not get, as they were too slow

  /// Calls f(name, count) for each, in this order.
  template <class F>
  void visit(F&& f) const {
    f("imu", imu);
    f("images", images);
    f("images_estimated", images_estimated);
    f("images_dropped", images_dropped);
    f("images_incomplete", images_incomplete);
    f("images_late", images_late);
    f("keyframes_left_out", keyframes_left_out);
    f("imu_refused", imu_refused);
    f("imu_late", imu_late);
    f("imu_reordered", imu_reordered);
    f("clock_leaps", clock_leaps);
    f("clock_set_back", clock_set_back);
    f("resets", resets);
    f("events_lost", events_lost);
  }
};

/// Percentiles of a time over all frames or readings so far, ms.
struct LatencySummary {
  double p50_ms = 0, p99_ms = 0, max_ms = 0;
  std::int64_t count = 0;
};

/// What people want to see of an output: {"clock_known", true}, {"round_trip_ms", 1.2}.
struct OutputFigure {
  std::string name;
  std::variant<bool, std::int64_t, double, std::string> value;
};
struct OutputFigures {
  std::string output;  ///< Sink::name()
  std::vector<OutputFigure> figures;
};

/// Whenever health changes, and once a second.
struct LiveStatus {
  Time t;       ///< newest stamp of any sensor
  Time host_t;  ///< time of this status, on CLOCK_MONOTONIC
  Health health;
  std::uint32_t reset_counter = 0;
  LiveCounts counts;
  LatencySummary shutter_to_pose;           ///< from the image's stamp to the estimator's answer
  LatencySummary pose_age;                  ///< of the newest estimate, taken at every IMU reading
  std::string problem;                      ///< of a sink or a source, in one sentence; empty: none
  std::vector<OutputFigures> outputs = {};  ///< of the sinks that have figures
};

/// For display: an image's features, and the window. Comes before the image's Odometry, where a sink wants_views().
struct LiveView {
  struct Feature {
    TrackId track;
    Vec2 pixel = Vec2::Zero();  ///< in the raw image of `camera`
    int age_frames = 0;         ///< 0: detected in this image
    double depth_m = 0;         ///< along that camera's axis; 0: not known
    int camera = 0;             ///< its number: of a pair the left one
  };
  struct Landmark {
    TrackId track;
    Vec3 p_W = Vec3::Zero();  ///< m, moved from the gauge to the published frame
  };
  Time t;                                    ///< of the image
  double shutter_to_pose_ms = 0;             ///< from the image's stamp to the estimator's answer
  std::vector<Feature> features = {};        ///< in the newest image
  std::vector<Landmark> landmarks = {};      ///< of the window; without a pose none
  std::vector<Vec3> keyframes_W = {};        ///< the window's, oldest first; likewise
  std::vector<Feature> right_features = {};  ///< of `features`, those also seen by the right camera of their pair, there
};

/// A moment marked by the user, to find it again.
struct LiveMark {
  Time t;  ///< newest stamp of any sensor
  std::string text;
};

/// Sensor events are those that the estimator consumes, in its order.
using LiveEvent =
    std::variant<ImuSample, StereoFrame, AidingSample, Odometry, LivePose, MapUpdate, LiveStatus, LiveView, LiveMark>;

}  // namespace fbvins
