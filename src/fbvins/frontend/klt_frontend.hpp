// SPDX-License-Identifier: Apache-2.0
// The `klt` frontend: Shi-Tomasi corners followed by gain-invariant Lucas-Kanade from left to left and from left
// to right, with prediction from the IMU, forward-backward checks and epipolar RANSAC.
// Synchronous; one instance is used by one thread at a time; allocates only while it grows.
//
//   KltFrontend frontend(rig, KltFrontendOptions{});
//   TrackedFrame tracked = frontend.process(packet, prior);
#pragma once

#include <array>

#include "fbvins/features/shi_tomasi.hpp"
#include "fbvins/frontend/epipolar_check.hpp"
#include "fbvins/frontend/klt_follower.hpp"
#include "fbvins/frontend/klt_options.hpp"
#include "fbvins/frontend/klt_stereo.hpp"
#include "fbvins/frontend/landmark_updates.hpp"
#include "fbvins/frontend/motion_check.hpp"
#include "fbvins/frontend/track_transfer.hpp"
#include "fbvins/frontend/typical_depth.hpp"

namespace fbvins {

class KltFrontend final : public LeadingFrontend {
 public:
  KltFrontend(const StereoRig& rig, const KltFrontendOptions& options);

  TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) override;
  /// Landmarks are ignored; what voids earlier positions voids the prior.
  void locate(const LandmarkUpdate& update) override;

  void follow_at_most(int features) override { most_ = features; }
  void stand_by(const SensorPacket& packet, const StatePrior& prior) override { predictor_.add(packet.imu, prior); }
  bool reaches(Time t) const override { return images_.reaches(t, options_.max_gap_s); }
  void begin_ids_at(std::int64_t id) override { tracks_.begin_ids_at(id); }
  std::int64_t next_id() const override { return tracks_.next_id(); }
  TrackTransfer hand_over() override;
  void take_over(TrackTransfer handover) override;

 private:
  void follow_tracks(const CameraMotion& motion, FrontendStats& stats);
  void reject_outliers(const CameraMotion& motion, FrontendStats& stats);
  void reject_slow_outliers(const Mat3& R_ba, FrontendStats& stats);
  void detect_corners(FrontendStats& stats);
  bool start_track(const Vec2& px);
  bool cut_patches(KltTrack& track, KltPatches& patches, const Pyramid& image) const;
  void match_stereo(FrontendStats& stats);
  bool measure_depth(KltTrack& track);

  KltFrontendOptions options_;
  int most_;  ///< features
  StereoRig rig_;
  FrameImages images_;
  MotionPredictor predictor_;
  TrackTable<KltTrack, KltPatches> tracks_;
  KltFollower follower_;
  MotionCheck motion_;
  EpipolarCheck epipolar_;
  ShiTomasiDetector detector_;
  KltStereoMatcher stereo_;
  LandmarkUpdates updates_;
  TypicalDepth typical_depth_;
  std::array<Mat3, KltTrack::kHistory> rotations_;  // of the last frames, oldest at next_rotation_
  int next_rotation_ = 0;
};

}  // namespace fbvins
