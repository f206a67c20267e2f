// SPDX-License-Identifier: Apache-2.0
// Keyframe -> MapUpdate: recognises places, verifies them by their images and against the odometry's own uncertainty,
// corrects the map frame at once and the whole map now and then. Anchors do so as well, and make M the frame of their building
// (docs/derivations/loop.md).
// A plain synchronous stage; one instance is used by one thread at a time.
//
//   LoopCloser closer(rig, LoopOptions{}, *vocabulary);
//   MapUpdate update = closer.process(keyframe);
//   Pose<M, B> T_MB = update.T_MG * odometry.gauge.T_GB;
//   closer.finish();
//   Trajectory<M> in_map = closer.corrected(trajectory_in_its_gauge);
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/loop/anchor_fit.hpp"
#include "fbvins/loop/candidate_search.hpp"
#include "fbvins/loop/flight_join.hpp"
#include "fbvins/loop/flight_keyframes.hpp"
#include "fbvins/loop/flight_session.hpp"
#include "fbvins/loop/loop_options.hpp"
#include "fbvins/loop/map_frame.hpp"
#include "fbvins/loop/place_cameras.hpp"
#include "fbvins/loop/place_map.hpp"
#include "fbvins/loop/place_verifier.hpp"
#include "fbvins/loop/relocaliser.hpp"
#include "fbvins/loop/thinning.hpp"
#include "fbvins/types/mapper.hpp"
#include "fbvins/types/trajectory.hpp"

namespace fbvins {

class LoopCloser final : public Mapper {
 public:
  LoopCloser(const StereoRig& rig, const LoopOptions& options, Vocabulary vocabulary);
  /// Continues an old map: M is that map's frame, and the flight must first be localised in it. With boosted descriptors, `stage`
  /// makes them; vocabulary and map must be of the same kind. Of a map whose places are in a file, the words must be by this
  /// vocabulary.
  LoopCloser(const StereoRig& rig, const LoopOptions& options, Vocabulary vocabulary, PlaceMap map,
             std::unique_ptr<DescriptorStage> stage = make_identity_stage());

  MapUpdate process(const Keyframe& keyframe) override;
  /// The same from features already extracted (joining maps, replay), of one of the cameras that see places; the images are not
  /// used.
  MapUpdate process(Place place, const Keyframe& keyframe, std::size_t camera = 0);

  /// Last optimisation of the pose graph. In an older map, what the flight makes superfluous leaves it then.
  PoseGraphReport finish();
  /// After finish(), where the best map is worth minutes: bundle adjustment over all of it.
  FinalAdjustmentReport adjust();

  /// With all that was flown, also what does not join.
  const PlaceMap& map() const { return map_; }
  /// Without the sessions of this flight that do not fit the older map, which is then as it was; empty where all of it fits.
  std::optional<PlaceMap> reduced() const;
  /// Those sessions, and why; after finish() as it judged them.
  std::map<std::uint32_t, std::string> objections() const { return verdict_ ? *verdict_ : join_.objections(map_); }
  /// Poses of a flight (in its gauge) as the map has them now: exact at keyframes, interpolated between them. Frames of a
  /// session that was never localised in the map are left out.
  Trajectory<M> corrected(const Trajectory<G>& in_G) const { return flight_.corrected(map_, in_G); }

 private:
  struct Proposal {
    KeyframeId candidate;
    VerifiedPose verified;
    MapEdge edge;
  };

  bool adds_nothing(const Keyframe& keyframe, std::optional<std::size_t> camera) const;
  MapUpdate begin_update(const Keyframe& keyframe);
  void end_update(const Keyframe& keyframe, MapUpdate& update);
  void begin_session(const Keyframe& keyframe);
  std::optional<Pose<M, M>> level(const GaugeState& gauge);
  Pose<M, M> to_upright() const;
  std::optional<Pose<M, M>> level_by_newest();
  void advance(const Keyframe& keyframe);
  MapKeyframe query_of(Place place, const Keyframe& keyframe, std::size_t camera);
  std::vector<KeyframeId> candidates_for(const MapKeyframe& query);
  double metres_with(const MapKeyframe& k) const;
  std::vector<Proposal> look_at(const MapKeyframe& query, const std::vector<KeyframeId>& candidates);
  void close(MapKeyframe& query, const std::vector<Proposal>& proposals, MapUpdate& update, std::vector<MapEdge>& found);
  bool take(const MapKeyframe& k, MeasuredPose seen);
  bool find_again(MapKeyframe& query, const Proposal& proposal, const MeasuredPose& seen);
  void found_at(const Pose<M, G>& T_MG, const MeasuredPose& seen);
  void relocalise(MapKeyframe& query, const std::vector<Proposal>& proposals, std::vector<MapEdge>& found);
  void join_session(const Pose<M, G>& T_MG);
  void add(MapKeyframe query, std::size_t camera, const KeyframeImu& imu, const std::vector<MapEdge>& found, MapUpdate& update);
  void take_anchors(const Keyframe& keyframe, MapUpdate& update);
  void take_tags(const Keyframe& keyframe, MapUpdate& update);
  std::optional<MapTag> tag_of_newest(const TagAnchor& anchor) const;
  bool tie(const MapTag& before, const MapTag& now, MapUpdate& update);
  std::optional<MapAnchor> attached(const Anchor& anchor) const;
  AnchoredPose anchored_pose(const MapAnchor& anchor) const;
  std::vector<AnchoredPose> anchored_poses() const;
  void find_building(MapUpdate& update);
  bool optimisation_due() const;
  PoseGraphReport optimise_graph();
  void optimise(MapUpdate& update);
  void take_out(KeyframeId id);
  void upkeep();

  LoopOptions options_;
  PlaceCameras cameras_;
  PlaceVerifier verifier_;
  PlaceMap map_;
  CandidateSearch search_;
  FlightJoin join_;
  MapFrame frame_;
  MapFrameFollower follower_;
  Relocaliser relocaliser_;
  Thinning thinning_;
  FlightKeyframes flight_;
  FlightSession session_;
  int news_since_optimised_ = 0;                                 ///< loops, and keyframes with anchors
  std::optional<std::map<std::uint32_t, std::string>> verdict_;  ///< of finish()
};

}  // namespace fbvins
