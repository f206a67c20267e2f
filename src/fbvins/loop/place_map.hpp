// SPDX-License-Identifier: Apache-2.0
// The map: keyframes with their features and poses in M, and relative poses between them. Relative poses are as estimated, in
// the gauge of a flight; M is gravity-aligned: rotated as a whole when gravity becomes better known (loop.md, L17).
// A value; one thread at a time.
//
//   PlaceMap map;
//   KeyframeId id = map.add({.t = t, .T_MB = T_MB, .place = place});
//   map.edges.push_back({older, id, T_ab, information, MapEdge::Kind::loop});
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fbvins/core/ids.hpp"
#include "fbvins/core/time.hpp"
#include "fbvins/loop/place.hpp"
#include "fbvins/loop/pose_graph.hpp"
#include "fbvins/types/gauge.hpp"
#include "fbvins/types/imu.hpp"

namespace fbvins {

/// Readings over a longer interval constrain its ends no better than the odometry's relative pose does.
inline constexpr double kLongestImu_s = 5;

class PlaceStore;
class Preintegration;

/// Velocity and biases at a keyframe as estimated in flight. Not saved.
struct MapMotion {
  Vec3 v_GB = Vec3::Zero();  ///< m/s, in the flight's gauge
  ImuBias bias;
};

struct MapKeyframe {
  KeyframeId id;
  Time t;
  std::uint32_t session = 0;  ///< which flight's gauge G it was taken in
  Pose<G, B> T_GB;            ///< as estimated in flight; never levelled
  Pose<M, B> T_MB;
  double path_m = 0;          ///< flown in this session until here
  int loops_ending_here = 0;  ///< loops that ended here
  int missed = 0;             ///< later sessions in a row that stood here and did not know it again
  bool placed = true;         ///< T_MB is known: its session has been localised in the map
  std::uint16_t camera = 0;   ///< of PlaceMap::cameras: the one that saw its place
  std::int32_t stored = -1;   ///< slot of its place in PlaceMap::store; -1: the place is here
  Place place;                ///< where it is stored: vertical and focal length only
  MapMotion motion;
};

struct MapEdge {
  enum class Kind : std::uint8_t { odometry, loop };
  KeyframeId from, to;
  Pose<B, B> T_from_to;
  Mat6 information = Mat6::Identity();
  Kind kind = Kind::odometry;
  /// Of an edge of the odometry: the readings on the way, where they are known. Not saved.
  std::shared_ptr<const Preintegration> imu = {};
};

/// An anchor, as a measurement of the keyframe nearest to it on the flight.
struct MapAnchor {
  KeyframeId keyframe;
  PartialPose measured;
};

/// A tag whose place in the building is not known, as a keyframe shows it.
struct MapTag {
  KeyframeId keyframe;
  int id = 0;
  Pose<B, Tag> T_BT;
  Mat6 covariance = Mat6::Identity();  ///< of (dp in B, dtheta in the tag)
};

/// What the map remembers of a flight, or of a part of one between two restarts, though its keyframes may be gone.
struct MapSession {
  std::uint32_t number = 0;
  Time began, ended;  ///< stamps of its first and last keyframe, of its sensors' clock
  int keyframes = 0;  ///< that it brought
  int loops = 0;      ///< that it closed with other sessions
  /// Of one camera: how uncertain its unit of length is, relatively, by itself; 0: its cameras measured lengths.
  double scale_sigma = 0;
  double log_scale = 0;  ///< logarithm of its unit in M, by the graph
};

/// What a map's file says of it, which a journal beside the file builds on.
struct MapBase {
  struct Keyframe {
    KeyframeId id;
    Pose<M, B> T_MB;
    int loops_ending_here;
  };
  std::uint64_t identity = 0;  ///< of the file's bytes
  Pose<B, C0> T_BC0;
  std::vector<Keyframe> keyframes;
  std::size_t edges = 0;
};

class PlaceMap {
 public:
  /// Adds it, under a new id unless it has one.
  KeyframeId add(MapKeyframe keyframe);
  /// Removes it; its neighbours are joined directly: composed odometry, loops and anchors moved to the keyframe before it.
  void remove(KeyframeId id);

  bool empty() const { return keyframes_.empty(); }
  std::size_t size() const { return keyframes_.size(); }
  const std::vector<MapKeyframe>& keyframes() const { return keyframes_; }  ///< in order of id
  std::vector<MapKeyframe>& keyframes() { return keyframes_; }
  const MapKeyframe* find(KeyframeId id) const;
  MapKeyframe* find(KeyframeId id);

  /// Its place, wherever that is; valid while it is held and the keyframe is in the map.
  std::shared_ptr<const Place> place_of(const MapKeyframe& k) const;
  std::shared_ptr<const BowVector> words_of(const MapKeyframe& k) const;
  /// Words by this vocabulary for all places that are in memory and have none by it.
  void fill_words(const Vocabulary& vocabulary);

  /// Moves all keyframes that have a place in M.
  void move(const Pose<M, M>& T);
  /// Turns them about `pivot_M`. Returns the motion.
  Pose<M, M> turn(const Quat& rotation, const Vec3& pivot_M);
  /// Sets the verticals of all keyframes of the newest session from `q_LG`, which turns its gauge level.
  void level(std::uint32_t session, const Quat& q_LG);

  /// A map that is longer flown in keeps every second of its older anchors, so that their number stays bounded.
  void add_anchor(MapAnchor anchor);

  /// Optimises the keyframes that edges connect to the first one or, in an anchored map, to one with an anchor. Those of
  /// sessions before `first` stay where they are, and cost nothing.
  PoseGraphReport optimise(const PoseGraphOptions& options, std::uint32_t first = 0);
  /// Of each edge at the present poses: squared residual in standard deviations, six of them.
  std::vector<double> chi2_of_edges(const PoseGraphOptions& options) const;

  /// T_BC of the camera that saw a keyframe's place.
  const Pose<B, C0>& T_BC(const MapKeyframe& k) const { return cameras[k.camera]; }
  Pose<M, C0> T_MC(const MapKeyframe& k) const { return k.T_MB * T_BC(k); }
  Vec3 up_B(const MapKeyframe& k) const { return T_BC(k).q * k.place.up_C0; }
  /// Number of the camera with this pose; a new one where there is none.
  std::uint16_t camera_at(const Pose<B, C0>& T_BC);

  /// What is remembered of a session; made where nothing is.
  MapSession& session(std::uint32_t number, Time t);
  /// Logarithm of the length in M of a session's metre; 0 where nothing is known of it.
  double log_scale_of(std::uint32_t session) const;

  std::vector<MapEdge> edges;
  std::vector<MapAnchor> anchors;
  std::vector<MapTag> tags;
  std::vector<MapSession> sessions;  ///< in order of number
  bool anchored = false;             ///< M is the frame A of the anchors
  std::vector<Pose<B, C0>> cameras =
      std::vector<Pose<B, C0>>(1);      ///< T_BC of those that saw places; the first, always there, says where the body is
  double gravity_mps2 = 9.81;           ///< of the readings on its edges
  bool boosted = false;                 ///< descriptors are boosted ones, which compare with such only
  std::string name;                     ///< for people; empty: none
  std::uint64_t vocabulary = 0;         ///< Vocabulary::fingerprint() of the words of its places; 0: they have none
  std::shared_ptr<const MapBase> base;  ///< of the file that it was opened from; null: none
  std::shared_ptr<PlaceStore> store;    ///< file with the places of keyframes that have a slot there; shared by copies

 private:
  std::vector<bool> in_graph() const;
  using Scales = std::map<std::uint32_t, std::size_t>;  ///< of a session, in a graph
  Scales add_scales(PoseGraph& graph, std::uint32_t first) const;
  PoseGraphEdge edge_of(const MapEdge& e, const Scales& scales) const;
  int index_of(KeyframeId id) const { return static_cast<int>(find(id) - keyframes_.data()); }

  std::vector<MapKeyframe> keyframes_;
  std::int64_t next_id_ = 0;
};

/// Makes the body that of another rig, whose first camera is the map's: the cameras' poses stay.
void change_body(PlaceMap& map, const Pose<B, C0>& T_BC0);

/// With the lengths of flights of one camera in metres of M: of their steps, loops and places, which must be in memory.
PlaceMap in_metres(PlaceMap map);

/// Covariance of A * B from those of A and B, each of (dp in its left frame, dtheta in its right one).
Mat6 compose_covariance(const Pose<B, B>& T_ab, const Mat6& cov_ab, const Pose<B, B>& T_bc, const Mat6& cov_bc);

}  // namespace fbvins
