// SPDX-License-Identifier: Apache-2.0
// The `orb` frontend (paper 2.1.1, 2.2.1, 2.2.3): ORB features matched by Hamming distance where the predicted pose
// expects them, left to right along the epipolar band, checked by epipolar RANSAC, and refined below a
// pixel by patch alignment. A track that is not seen for a moment (blur, occlusion, a black image) is remembered with
// its descriptor and patch, and continues under its old id when it is seen again; so does, however much later, one whose
// landmark the estimator has located.
// Synchronous; one instance is used by one thread at a time; allocates only while it grows.
//
//   OrbFrontend frontend(rig, OrbFrontendOptions{});
//   TrackedFrame tracked = frontend.process(packet, prior);
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/features/descriptor_stage.hpp"
#include "fbvins/features/epipolar_ransac.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/features/patch_refine.hpp"
#include "fbvins/frontend/frontend.hpp"
#include "fbvins/frontend/klt_stereo.hpp"
#include "fbvins/frontend/landmark_memory.hpp"
#include "fbvins/frontend/orb_matching.hpp"
#include "fbvins/frontend/orb_stereo.hpp"
#include "fbvins/frontend/prediction.hpp"

namespace fbvins {

struct OrbFrontendOptions {
  int max_features = 180;
  double min_distance_px = 14;
  int max_remembered = 200;
  double memory_s = 1.0;
  int out_of_sight_max_distance = 45;
  double search_px = 12;
  double search_blind_px = 50;
  bool subpixel = true;
  bool fill_in = true;
  double fill_in_correlation = 0.85;
  double max_creep_px = 0.7;
  double max_uncertainty_px = 0.18;
  double max_uncertainty_few_px = 3.0;
  double forward_backward_px = 0.7;
  double epipolar_px = 1.0;
  double sigma_px = 0.6;
  double sigma_unrefined_px = 1.5;
  OrbOptions orb;
  GuidedMatchOptions matching;
  OrbStereoOptions stereo;
  PatchRefineOptions refine;
  KltOptions alignment;
  KltStereoOptions stereo_fill_in;
  RecognitionOptions recognition;

  template <class V>
  void visit(V&& v) {
    v("max_features", max_features, "", "features followed at once", 10, 2000);
    v("min_distance_px", min_distance_px, "px", "smallest distance of a new feature from others", 2.0, 200.0);
    v("max_remembered", max_remembered, "", "features remembered while out of sight", 0, 2000);
    v("memory_s", memory_s, "s", "how long a feature out of sight is remembered", 0.0, 10.0);
    v("out_of_sight_max_distance", out_of_sight_max_distance, "bit",
      "largest Hamming distance of a match of a feature that was out of sight", 1, 256);
    v("search_px", search_px, "px", "search radius around a prediction from the estimator's state", 2.0, 200.0);
    v("search_blind_px", search_blind_px, "px", "search radius when only the rotation or nothing is known", 2.0, 400.0);
    v("subpixel", subpixel, "", "refine matched positions by patch alignment");
    v("fill_in", fill_in, "", "follow features without a descriptor match by patch alignment alone");
    v("fill_in_correlation", fill_in_correlation, "", "correlation asked of a feature followed by alignment alone", 0.0, 1.0);
    v("max_creep_px", max_creep_px, "px", "largest disagreement between the newest patch and the reference", 0.05, 10.0);
    v("max_uncertainty_px", max_uncertainty_px, "px/grey",
      "uncertainty of a new feature's position along its weakest direction, for noise of one grey value", 1e-4, 10.0);
    v("max_uncertainty_few_px", max_uncertainty_few_px, "px/grey",
      "the same where the image has too few such features for half of max_features", 1e-4, 10.0);
    v("forward_backward_px", forward_backward_px, "px", "largest error of following a feature there and back", 0.05, 10.0);
    v("epipolar_px", epipolar_px, "px", "RANSAC threshold between left images", 0.1, 10.0);
    v("sigma_px", sigma_px, "px", "standard deviation of an observation, for the estimator", 0.05, 10.0);
    v("sigma_unrefined_px", sigma_unrefined_px, "px", "the same without subpixel: descriptors alone are good to a pixel", 0.05,
      10.0);
    v.group("orb", orb, "feature extraction");
    v.group("matching", matching, "matching over time");
    v.group("stereo", stereo, "matching from left to right by descriptor");
    v.group("refine", refine, "refinement below a pixel");
    v.group("alignment", alignment, "Lucas-Kanade alignment");
    v.group("recognition", recognition, "landmarks known again after they were out of view");
    v.group("stereo_fill_in", stereo_fill_in, "matching from left to right by alignment, where descriptors found nothing");
  }
};

class OrbFrontend final : public Frontend {
 public:
  /// `stage` may improve the descriptors of each image; the default leaves them.
  OrbFrontend(const StereoRig& rig, const OrbFrontendOptions& options,
              std::unique_ptr<DescriptorStage> stage = make_identity_stage());

  TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) override;
  void locate(const LandmarkUpdate& update) override;

 private:
  /// Levels of the pyramid that patches are aligned on.
  static constexpr int kAlignmentLevels = 3;
  /// A track nearer to the image's edge than this has no whole patch.
  static constexpr double kBorder_px = kKltReach - 2;
  /// Frames over which outliers are looked for, the newest included.
  static constexpr std::size_t kHistory = 6;
  struct Sighting {
    Vec2 normalised = Vec2::Zero();
    std::int64_t frame = -1;
  };
  struct Track {
    TrackId id;
    std::size_t slot = 0;    // of its patches
    Descriptor descriptor;   // as last seen
    Descriptor raw;          // the same before it was improved
    int level = 0;           // as last seen
    Vec2 px = Vec2::Zero();  // where it is, or is expected while out of sight
    Vec2 normalised = Vec2::Zero();
    std::optional<double> inverse_depth;  // 1/m along z of C0
    std::optional<Observation> right;     // match in the present right image
    Time last_seen;
    int age_frames = 0;
    bool in_sight = false;      // has an observation in the newest image
    bool was_in_sight = false;  // had one in the image before
    Vec2 previous_px = Vec2::Zero();
    Vec2 previous_normalised = Vec2::Zero();
    double depth_factor = 1;  // depth now / depth before
    bool renew_reference = false;
    std::array<Sighting, kHistory> history;  // of frame f at f % kHistory
    std::optional<Vec3> seen_from_W;         // camera when it was last in sight
    std::optional<Vec3> p_W;                 // where the estimator has left it, once it has
    bool alive = true;
  };
  struct Patches {
    KltTemplate newest;        // of the last image it was seen in; only for tracks in sight
    PatchReference reference;  // where the track began or was renewed
  };

  bool ingest(const SensorPacket& packet, FrontendStats& stats);
  void extract_left(const ImageView& image, FrontendStats& stats);
  void predict(const CameraMotion& motion);
  void match_tracks(const CameraMotion& motion);
  void match_raw(FrontendStats& stats);
  void remember_matches(const std::vector<int>& found, std::vector<std::pair<TrackId, Vec2>>& matched) const;
  void count_inliers(FrontendStats& stats) const;
  void locate_tracks(FrontendStats& stats);
  std::optional<Vec2> refine_match(Track& track, const Vec2& start_px, double scale);
  std::optional<Vec2> follow_by_alignment(Track& track, const Vec2& expected_px);
  std::optional<Vec2> hold_to_reference(Track& track, const Vec2& newest_px);
  bool returns(const Track& track, const Vec2& px);
  bool settle(Track& track, const Vec2& px);
  void remember(const Track& track);
  void recognise(FrontendStats& stats);
  bool begin_again(const ExpectedLandmark& expected, std::size_t keypoint);
  void reject_outliers(const StatePrior& prior, FrontendStats& stats);
  void check_epipolar(const CameraMotion& motion, std::int64_t then, FrontendStats& stats);
  void thin_out();
  void cut_patches();
  void start_tracks(FrontendStats& stats);
  bool start_track(std::size_t keypoint, double max_uncertainty_px);
  void match_stereo(FrontendStats& stats);
  std::optional<Vec2> find_in_right(const Track& track);
  void forget(Time now);
  void drop_dead_tracks();
  Observation observe(const Camera& camera, const Vec2& px, const Vec2& normalised) const;
  void report(TrackedFrame& out) const;
  /// Reorders the numbers; 0 of none.
  static double median(std::vector<double>& numbers);

  OrbFrontendOptions options_;
  StereoRig rig_;
  std::unique_ptr<DescriptorStage> stage_;
  MotionPredictor predictor_;
  OrbExtractor extractor_;
  GuidedMatcher matcher_;
  OrbStereoMatcher stereo_;
  KltStereoMatcher stereo_fill_in_;
  PatchRefiner refiner_;
  Rng rng_;
  LandmarkMemory memory_;
  std::uint32_t reset_counter_ = 0;  // of the W in which landmarks are located

  Pyramid left_, previous_left_, right_;
  KltTemplate scratch_;
  ImageView right_view_;
  OrbFeatures left_features_, right_features_;
  bool has_previous_ = false;
  Time now_, previous_t_;
  std::optional<Pose<W, C0>> T_WC_;  // of the newest image, where the state is known
  std::int64_t frame_count_ = 0;
  std::array<Time, kHistory> history_t_;
  double typical_inverse_depth_ = 0;  // 1/m, median of the features matched last
  std::int64_t next_track_ = 0;
  std::vector<Track> tracks_;
  std::vector<Patches> patches_;
  std::vector<std::size_t> free_slots_;
  // buffers
  std::vector<GuidedQuery> queries_;
  std::vector<ExpectedLandmark> expected_;
  std::vector<int> found_, found_raw_;
  OrbFeatures raw_left_;                                         // before they were improved, where they are
  std::vector<std::pair<TrackId, Vec2>> matched_, matched_raw_;  // tracks and the keypoints found for them
  std::vector<std::uint8_t> keypoint_used_;
  std::vector<Vec2> points_a_, points_b_;
  std::vector<double> numbers_, numbers_y_;
  std::vector<std::size_t> order_;
};

}  // namespace fbvins
