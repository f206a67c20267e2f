// SPDX-License-Identifier: Apache-2.0
// The `orb` frontend (paper 2.1.1, 2.2.1, 2.2.3): ORB features, followed from image to image and into the right image by patch
// alignment from their predicted positions, and checked by epipolar RANSAC. In some images keypoints are extracted, described
// and matched by Hamming distance, which finds tracks that alignment lost, re-observes landmarks and starts tracks where there
// are few. A track that is not observed for a moment (blur, occlusion, a black image) is kept with
// its descriptor and patch, and continues under its old id when it is observed again; so does, however much later, one whose
// landmark the estimator has located.
// Synchronous; one instance is used by one thread at a time; allocates only while it grows.
//
//   OrbFrontend frontend(rig, OrbFrontendOptions{});
//   TrackedFrame tracked = frontend.process(packet, prior);
#pragma once

#include <memory>

#include "fbvins/frontend/detection_policy.hpp"
#include "fbvins/frontend/landmark_updates.hpp"
#include "fbvins/frontend/orb_depth.hpp"
#include "fbvins/frontend/orb_locator.hpp"
#include "fbvins/frontend/orb_options.hpp"
#include "fbvins/frontend/orb_outlier_check.hpp"
#include "fbvins/frontend/orb_recogniser.hpp"
#include "fbvins/frontend/orb_starter.hpp"
#include "fbvins/frontend/orb_track_matcher.hpp"
#include "fbvins/frontend/track_transfer.hpp"

namespace fbvins {

class OrbFrontend final : public LeadingFrontend {
 public:
  /// `stage` may improve the descriptors of each image; the default does not change them. Frontends of one thread can share it.
  OrbFrontend(const StereoRig& rig, const OrbFrontendOptions& options,
              std::shared_ptr<DescriptorStage> stage = make_identity_stage());

  TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) override;
  void locate(const LandmarkUpdate& update) override;

  void follow_at_most(int features) override;
  void stand_by(const SensorPacket& packet, const StatePrior& prior) override;
  bool reaches(Time t) const override { return images_.reaches(t, longest_gap_s()); }
  void begin_ids_at(std::int64_t id) override { tracks_.begin_ids_at(id); }
  std::int64_t next_id() const override { return tracks_.next_id(); }
  TrackTransfer hand_over() override;
  void take_over(TrackTransfer handover) override;

  /// Whether it is a current track, or its landmark is remembered.
  bool can_reobserve(TrackId track) const;

 private:
  double longest_gap_s() const;
  bool follow(const ImageView& left, FrontendStats& stats);
  void detect(const ImageView& left, FrontendStats& stats);
  void finish_before(FrontendStats& stats);
  void drop_ended();
  bool resume(const TransferredTrack& handed, const Pyramid& image);

  OrbFrontendOptions options_;
  int most_;                 ///< features
  bool spreads_work_;        ///< of improved descriptors, over the image of the keypoints and the next one
  bool unfinished_ = false;  ///< the image before
  Camera camera_;
  Pose<C1, C0> T_C1C0_;
  FrameImages images_;
  MotionPredictor predictor_;
  OrbDescriber describer_;
  OrbImprover improver_;
  OrbView view_;

  OrbTracks tracks_;
  OrbTrackMatcher matcher_;
  OrbLocator locator_;
  OrbRecogniser recogniser_;
  OrbOutlierCheck outliers_;
  OrbStarter starter_;
  OrbDepth depth_;
  DetectionPolicy detection_;
  LandmarkUpdates updates_;
};

}  // namespace fbvins
