// SPDX-License-Identifier: Apache-2.0
// The `klt` frontend: Shi-Tomasi corners followed by gain-invariant Lucas-Kanade from left to left and from left
// to right, with prediction from the IMU, forward-backward checks and epipolar RANSAC.
// Synchronous; one instance is used by one thread at a time; allocates only while it grows.
//
//   KltFrontend frontend(rig, KltFrontendOptions{});
//   TrackedFrame tracked = frontend.process(packet, prior);
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/features/epipolar_ransac.hpp"
#include "fbvins/features/klt.hpp"
#include "fbvins/features/pyramid.hpp"
#include "fbvins/features/shi_tomasi.hpp"
#include "fbvins/frontend/frontend.hpp"
#include "fbvins/frontend/klt_stereo.hpp"
#include "fbvins/frontend/prediction.hpp"

namespace fbvins {

struct KltFrontendOptions {
  int max_features = 150;
  int pyramid_levels = 4;
  double sigma_px = 0.6;
  double forward_backward_px = 0.7;
  double epipolar_px = 0.7;
  double long_epipolar_px = 1.0;
  double min_anchor_correlation = 0.8;
  double max_creep_px = 0.7;
  double max_gap_s = 0.6;
  KltOptions klt;
  KltStereoOptions stereo;
  ShiTomasiOptions corners;

  template <class V>
  void visit(V&& v) {
    v("max_features", max_features, "", "features followed at once", 10, 2000);
    v("pyramid_levels", pyramid_levels, "", "pyramid levels, the finest included", 1, kMaxPyramidLevels);
    v("sigma_px", sigma_px, "px", "standard deviation of an observation, for the estimator", 0.05, 10.0);
    v("forward_backward_px", forward_backward_px, "px", "largest error of following a feature there and back", 0.05, 10.0);
    v("epipolar_px", epipolar_px, "px", "RANSAC threshold between consecutive left images", 0.1, 10.0);
    v("long_epipolar_px", long_epipolar_px, "px", "RANSAC threshold between left images six frames apart", 0.1, 10.0);
    v("min_anchor_correlation", min_anchor_correlation, "", "correlation with the anchor below which it is taken anew", -1.0,
      1.0);
    v("max_creep_px", max_creep_px, "px", "a feature farther from its anchor's match has slid and is dropped", 0.1, 20.0);
    v("max_gap_s", max_gap_s, "s", "after a longer gap without left image features start anew", 0.01, 5.0);
    v.group("klt", klt, "Lucas-Kanade alignment");
    v.group("stereo", stereo, "matching from left to right");
    v.group("corners", corners, "corner detection");
  }
};

class KltFrontend final : public Frontend {
 public:
  KltFrontend(const StereoRig& rig, const KltFrontendOptions& options);

  TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) override;

 private:
  static constexpr int kHistory = 6;  // frames of the long epipolar check

  struct Track {
    TrackId id;
    std::size_t slot = 0;    // of its template
    Vec2 px = Vec2::Zero();  // in the last left image it was seen in
    Vec2 normalised = Vec2::Zero();
    std::optional<double> inverse_depth;  // 1/m along z of C0, from the last stereo match
    std::optional<StereoMatch> right;     // match in the present right image
    int age_frames = 0;
    // since its anchor was taken:
    Mat3 R_now_anchor = Mat3::Identity();  // rotation of the left camera
    double depth_ratio = 1;                // depth now / depth then
    Mat2 J_normalised_pixel_anchor = Mat2::Identity();
    std::array<Vec2, kHistory> history{};  // normalised positions, that of age a at a % kHistory
    // while being followed into the present image:
    Vec2 previous_px = Vec2::Zero();
    Vec2 previous_normalised = Vec2::Zero();
    bool alive = true;
  };

  void ingest(const SensorPacket& packet, FrontendStats& stats);
  void follow_tracks(const CameraMotion& motion, FrontendStats& stats);
  bool follow(Track& track, const CameraMotion& motion, FrontendStats& stats);
  KltResult align_to_anchor(const Track& track, const Vec2& start_px);
  void set_anchor(Track& track);
  Vec2 predict(const Track& track, const CameraMotion& motion) const;
  void reject_outliers(const CameraMotion& motion, FrontendStats& stats);
  void reject_slow_outliers(const Mat3& R_ba, FrontendStats& stats);
  EpipolarResult drop_off_epipolar(const std::optional<Mat3>& R_ba, double threshold_px, FrontendStats& stats);
  void detect_corners(FrontendStats& stats);
  void match_stereo(FrontendStats& stats);
  void drop_dead_tracks();
  void drop_all_tracks();
  std::size_t take_slot();
  Observation observe(const Camera& camera, const Vec2& px, const Vec2& normalised) const;
  void report(TrackedFrame& out);

  KltFrontendOptions options_;
  StereoRig rig_;
  MotionPredictor predictor_;
  ShiTomasiDetector detector_;
  KltStereoMatcher stereo_;
  Rng rng_;
  double typical_inverse_depth_ = 0;  // 1/m, median of the features matched last

  Pyramid left_, previous_left_, right_;
  Time previous_t_;  // of previous_left_
  std::int64_t next_track_ = 0;
  std::vector<Track> tracks_;
  std::vector<KltTemplate> templates_;
  std::vector<KltAnchor> anchors_;
  std::vector<std::size_t> free_slots_;
  KltTemplate warped_;                    // of the anchor being used
  std::array<Mat3, kHistory> rotations_;  // of the last frames, oldest at next_rotation_
  int next_rotation_ = 0;
  std::vector<Vec2> points_a_, points_b_;  // buffers
  std::vector<std::size_t> indices_;
  std::vector<double> numbers_;
};

}  // namespace fbvins
