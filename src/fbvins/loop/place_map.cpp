// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_map.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/imu/preintegration.hpp"
#include "fbvins/loop/map_tags.hpp"
#include "fbvins/loop/place_store.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kMostAnchors = 5000;
/// Differences of poses (m and rad together) below this are rounding errors.
constexpr double kSamePose = 1e-9;
/// Beyond this a scale is no error of an odometry.
constexpr double kLargestLogScale = 0.5;

template <class A, class B>
bool is_rounding(const Pose<A, B>& T) {
  return T.p.norm() + 2 * T.q.vec().norm() < kSamePose;
}

template <class Keyframes>
auto find_in(Keyframes& keyframes, KeyframeId id) -> decltype(keyframes.data()) {
  const auto it =
      std::lower_bound(keyframes.begin(), keyframes.end(), id, [](const MapKeyframe& k, KeyframeId i) { return k.id < i; });
  return it != keyframes.end() && it->id == id ? &*it : nullptr;
}

std::shared_ptr<const Preintegration> joined(const MapEdge& first, const MapEdge& second) {
  if (!first.imu || !second.imu || first.imu->dt_s() + second.imu->dt_s() > kLongestImu_s) return nullptr;
  Preintegration both = *first.imu;
  both.append(*second.imu);
  return std::make_shared<const Preintegration>(std::move(both));
}

MapEdge composed(const MapEdge& first, const MapEdge& second, MapEdge::Kind kind) {
  const Mat6 cov =
      compose_covariance(first.T_from_to, inverted(first.information), second.T_from_to, inverted(second.information));
  const Mat6 information = inverted(cov);
  return {
      first.from,           second.to, first.T_from_to * second.T_from_to, 0.5 * (information + information.transpose()), kind,
      joined(first, second)};
}

/// The same edge from its other end.
MapEdge reversed(const MapEdge& e) {
  // Of T^-1, with p' its position: dp' = -R^T dp + hat(p') dtheta, dtheta' = -R dtheta.
  const Mat3 R = e.T_from_to.R();
  Mat6 J = Mat6::Zero();
  const Pose<B, B> inverse = e.T_from_to.inverse();
  J.topLeftCorner<3, 3>() = -R.transpose();
  J.topRightCorner<3, 3>() = hat(-inverse.p).transpose();
  J.bottomRightCorner<3, 3>() = -R;
  const Mat6 cov = J * inverted(e.information) * J.transpose();
  const Mat6 information = inverted(cov);
  return {e.to, e.from, inverse, 0.5 * (information + information.transpose()), e.kind, nullptr};
}

}  // namespace

Mat6 compose_covariance(const Pose<B, B>& T_ab, const Mat6& cov_ab, const Pose<B, B>& T_bc, const Mat6& cov_bc) {
  const Mat3 R_ab = T_ab.R(), R_bc = T_bc.R();
  Mat6 J_ab = Mat6::Identity(), J_bc = Mat6::Zero();
  J_ab.topRightCorner<3, 3>() = -R_ab * hat(T_bc.p);
  J_ab.bottomRightCorner<3, 3>() = R_bc.transpose();
  J_bc.topLeftCorner<3, 3>() = R_ab;
  J_bc.bottomRightCorner<3, 3>().setIdentity();
  return J_ab * cov_ab * J_ab.transpose() + J_bc * cov_bc * J_bc.transpose();
}

KeyframeId PlaceMap::add(MapKeyframe keyframe) {
  if (!keyframe.id.valid()) keyframe.id = KeyframeId{next_id_};
  next_id_ = std::max(next_id_, keyframe.id.value + 1);
  keyframes_.push_back(std::move(keyframe));
  return keyframes_.back().id;
}

const MapKeyframe* PlaceMap::find(KeyframeId id) const { return find_in(keyframes_, id); }
MapKeyframe* PlaceMap::find(KeyframeId id) { return find_in(keyframes_, id); }

std::shared_ptr<const Place> PlaceMap::place_of(const MapKeyframe& k) const {
  if (k.stored < 0) return {std::shared_ptr<const Place>(), &k.place};
  std::shared_ptr<Place> place = store->place(static_cast<std::size_t>(k.stored));
  place->up_C0 = k.place.up_C0, place->focal_px = k.place.focal_px;
  return place;
}

std::shared_ptr<const BowVector> PlaceMap::words_of(const MapKeyframe& k) const {
  if (k.stored < 0) return {std::shared_ptr<const BowVector>(), &k.place.words};
  return store->words_of(static_cast<std::size_t>(k.stored));
}

void PlaceMap::fill_words(const Vocabulary& words) {
  const bool same = vocabulary == words.fingerprint();
  for (MapKeyframe& k : keyframes_) {
    BowVector& bow = k.place.words;
    if (k.stored < 0 && (!same || bow.empty() || bow.back().word >= words.words())) bow = words.words_of(k.place.descriptors);
  }
  vocabulary = words.fingerprint();
}

void PlaceMap::remove(KeyframeId id) {
  const MapKeyframe* gone = find(id);
  if (gone == nullptr) return;
  const auto is = [&](MapEdge::Kind kind, auto end) {
    return std::find_if(edges.begin(), edges.end(), [&, end](const MapEdge& e) { return e.kind == kind && e.*end == id; });
  };
  const auto before = is(MapEdge::Kind::odometry, &MapEdge::to), after = is(MapEdge::Kind::odometry, &MapEdge::from);
  std::vector<MapEdge> added;
  if (before != edges.end() && after != edges.end()) added.push_back(composed(*before, *after, MapEdge::Kind::odometry));
  // Loops move to the neighbour in time, through the odometry between the two.
  const MapEdge* bridge = nullptr;
  MapEdge turned;
  if (before != edges.end()) bridge = &*before;
  else if (after != edges.end()) turned = reversed(*after), bridge = &turned;
  // A neighbour that has enough loops gets no more: the graph must not grow with every round in the same room.
  constexpr int kEnoughLoops = 6;
  int loops_of_neighbour = 0;
  if (bridge != nullptr)
    for (const MapEdge& e : edges)
      loops_of_neighbour += e.kind == MapEdge::Kind::loop && (e.from == bridge->from || e.to == bridge->from);
  if (bridge != nullptr)
    for (const MapEdge& e : edges) {
      if (e.kind != MapEdge::Kind::loop || (e.from != id && e.to != id) || loops_of_neighbour++ >= kEnoughLoops) continue;
      const MapEdge moved = composed(*bridge, e.from == id ? e : reversed(e), MapEdge::Kind::loop);
      if (moved.from != moved.to) added.push_back(moved);
    }
  for (MapAnchor& a : anchors)
    if (a.keyframe == id && bridge != nullptr)
      a = {bridge->from, carried(a.measured, bridge->T_from_to, inverted(bridge->information))};
  for (MapTag& t : tags)
    if (t.keyframe == id && bridge != nullptr) t = carried(t, bridge->from, bridge->T_from_to, inverted(bridge->information));
  std::erase_if(anchors, [&](const MapAnchor& a) { return a.keyframe == id; });
  std::erase_if(tags, [&](const MapTag& t) { return t.keyframe == id; });
  std::erase_if(edges, [&](const MapEdge& e) { return e.from == id || e.to == id; });
  edges.insert(edges.end(), added.begin(), added.end());
  keyframes_.erase(keyframes_.begin() + (gone - keyframes_.data()));
}

Pose<M, M> PlaceMap::turn(const Quat& rotation, const Vec3& pivot_M) {
  const Pose<M, M> T(rotation, Vec3(pivot_M - rotation * pivot_M));
  move(T);
  return T;
}

void PlaceMap::move(const Pose<M, M>& T) {
  for (MapKeyframe& k : keyframes_)
    if (k.placed) k.T_MB = T * k.T_MB;
}

void PlaceMap::add_anchor(MapAnchor anchor) {
  anchors.push_back(std::move(anchor));
  if (anchors.size() <= kMostAnchors) return;
  const auto begin = anchors.begin(), middle = begin + kMostAnchors / 2;
  auto kept = begin;
  for (auto a = begin; a < middle; a += 2) *kept++ = *a;
  anchors.erase(kept, middle);
}

void PlaceMap::level(std::uint32_t session, const Quat& q_LG) {
  for (auto k = keyframes_.rbegin(); k != keyframes_.rend() && k->session >= session; ++k)
    if (k->session == session) k->place.up_C0 = (q_LG * k->T_GB.q * T_BC(*k).q).conjugate() * Vec3::UnitZ();
}

std::uint16_t PlaceMap::camera_at(const Pose<B, C0>& T_BC) {
  const auto at = std::ranges::find_if(cameras, [&](const auto& T) { return is_rounding(T.inverse() * T_BC); });
  const auto number = static_cast<std::uint16_t>(at - cameras.begin());
  if (at == cameras.end()) cameras.push_back(T_BC);
  return number;
}

/// Keyframes connected to the first one or to an anchored one; the others have no place in M yet and stay as they are.
std::vector<bool> PlaceMap::in_graph() const {
  std::vector<std::vector<int>> neighbours(keyframes_.size());
  for (const MapEdge& e : edges) {
    neighbours[static_cast<std::size_t>(index_of(e.from))].push_back(index_of(e.to));
    neighbours[static_cast<std::size_t>(index_of(e.to))].push_back(index_of(e.from));
  }
  std::vector<bool> joined(keyframes_.size(), false);
  std::vector<int> open;
  const auto join = [&](int i) {
    if (!joined[static_cast<std::size_t>(i)]) joined[static_cast<std::size_t>(i)] = true, open.push_back(i);
  };
  join(0);
  for (const MapAnchor& a : anchors)
    if (const int i = index_of(a.keyframe); anchored && keyframes_[static_cast<std::size_t>(i)].placed) join(i);
  while (!open.empty()) {
    const int at = open.back();
    open.pop_back();
    for (const int n : neighbours[static_cast<std::size_t>(at)]) join(n);
  }
  return joined;
}

/// Scales of the sessions whose unit is uncertain, by their number. Those before `first` stay.
PlaceMap::Scales PlaceMap::add_scales(PoseGraph& graph, std::uint32_t first) const {
  Scales scales;
  for (const MapSession& s : sessions)
    if (s.scale_sigma > 0) scales.emplace(s.number, graph.add_scale({s.log_scale, s.scale_sigma, s.number < first}));
  return scales;
}

PoseGraphEdge PlaceMap::edge_of(const MapEdge& e, const Scales& scales) const {
  const auto scale_of = [&](KeyframeId id) {
    const auto scale = scales.empty() ? scales.end() : scales.find(find(id)->session);
    return scale == scales.end() ? std::nullopt : std::optional(scale->second);
  };
  return {index_of(e.from), index_of(e.to), e.T_from_to, e.information, e.kind == MapEdge::Kind::loop, 1,
          scale_of(e.from), scale_of(e.to)};
}

double PlaceMap::log_scale_of(std::uint32_t number) const {
  const auto s = std::ranges::find(sessions, number, &MapSession::number);
  return s == sessions.end() ? 0 : s->log_scale;
}

std::vector<double> PlaceMap::chi2_of_edges(const PoseGraphOptions& options) const {
  PoseGraph graph;
  for (const MapKeyframe& k : keyframes_) graph.add_node(k.T_MB, up_B(k));
  const Scales scales = add_scales(graph, 0);
  std::vector<double> all;
  all.reserve(edges.size());
  for (const MapEdge& e : edges) all.push_back(graph.chi2(edge_of(e, scales), options));
  return all;
}

MapSession& PlaceMap::session(std::uint32_t number, Time t) {
  const auto at = std::lower_bound(sessions.begin(), sessions.end(), number,
                                   [](const MapSession& s, std::uint32_t n) { return s.number < n; });
  return at != sessions.end() && at->number == number ? *at : *sessions.insert(at, {number, t, t});
}

PoseGraphReport PlaceMap::optimise(const PoseGraphOptions& options, std::uint32_t first) {
  if (keyframes_.empty()) return {};
  PoseGraph graph;
  std::vector<bool> moves = in_graph();
  const auto may_move = [&](KeyframeId id) { return moves[static_cast<std::size_t>(index_of(id))]; };
  for (std::size_t i = 0; i < keyframes_.size(); ++i) moves[i] = moves[i] && keyframes_[i].session >= first;
  for (std::size_t i = 0; i < keyframes_.size(); ++i)
    graph.add_node(keyframes_[i].T_MB, up_B(keyframes_[i]), !moves[i] || (i == 0 && !anchored));
  // Nothing but other flights, or anchors, says anything of a flight's scale.
  const Scales scales = sessions.size() > 1 || anchored ? add_scales(graph, first) : Scales{};
  for (const MapEdge& e : edges)
    if (may_move(e.from) || may_move(e.to)) graph.add_edge(edge_of(e, scales));
  if (anchored) {
    for (const MapAnchor& a : anchors)
      if (may_move(a.keyframe)) graph.add_anchor({index_of(a.keyframe), a.measured});
    for (std::size_t i = 0; i < keyframes_.size(); ++i)
      if (moves[i] && (i == 0 || keyframes_[i].session != keyframes_[i - 1].session))
        graph.add_anchor({static_cast<int>(i), about_here(keyframes_[i].T_MB), true});
  }
  const PoseGraphReport report = graph.optimise(options);
  for (std::size_t i = 0; i < keyframes_.size(); ++i) keyframes_[i].T_MB = graph.poses()[i];
  for (MapSession& s : sessions)
    if (const auto scale = scales.find(s.number); scale != scales.end())
      s.log_scale = std::clamp(graph.scales()[scale->second].log, -kLargestLogScale, kLargestLogScale);
  return report;
}

void change_body(PlaceMap& map, const Pose<B, C0>& T_BC0) {
  const Pose<B, B> T_old_new = map.cameras[0] * T_BC0.inverse();
  map.cameras[0] = T_BC0;
  if (is_rounding(T_old_new)) return;
  const Pose<B, B> T_new_old = T_old_new.inverse();
  for (std::size_t i = 1; i < map.cameras.size(); ++i) map.cameras[i] = T_new_old * map.cameras[i];
  for (MapKeyframe& k : map.keyframes()) k.T_MB = k.T_MB * T_old_new, k.T_GB = k.T_GB * T_old_new;
  for (MapEdge& e : map.edges) {
    Mat6 cov = compose_covariance(T_new_old, Mat6::Zero(), e.T_from_to, inverted(e.information));
    cov = compose_covariance(T_new_old * e.T_from_to, cov, T_old_new, Mat6::Zero());
    const Mat6 information = inverted(cov);
    e.T_from_to = T_new_old * e.T_from_to * T_old_new;
    e.information = 0.5 * (information + information.transpose());
    e.imu = nullptr;
  }
  for (MapAnchor& a : map.anchors) a.measured = carried(a.measured, T_new_old, Mat6::Zero());
  for (MapTag& t : map.tags) t = carried(t, t.keyframe, T_new_old, Mat6::Zero());
}

PlaceMap in_metres(PlaceMap map) {
  for (MapEdge& e : map.edges) {
    const double logs = map.log_scale_of(map.find(e.from)->session) + map.log_scale_of(map.find(e.to)->session);
    const double metre = std::exp(0.5 * logs);
    e.T_from_to.p *= metre;
    e.information.topRows<3>() /= metre;
    e.information.leftCols<3>() /= metre;
  }
  for (MapKeyframe& k : map.keyframes()) {
    const double metre = std::exp(map.log_scale_of(k.session));
    k.motion.v_GB *= metre;
    for (PlaceFeature& f : k.place.features) {
      f.inverse_depth /= static_cast<float>(metre);
      f.sigma_inverse_depth /= static_cast<float>(metre);
    }
  }
  for (MapSession& s : map.sessions) s.log_scale = 0;
  return map;
}

}  // namespace fbvins
