// SPDX-License-Identifier: Apache-2.0
// Private: the part of a flight in the odometry's present gauge, since its last restart: the way that it has flown and how that
// drifts, how it is level, and which keyframes of the map are its newest. A value; one thread at a time.
//
//   FlightSession session(keyframe, number, map.empty(), drift, cameras);
//   session.advance(keyframe, newest_t);                        // every keyframe of its gauge
//   session.take_level(session.measured_level(keyframe.gauge));
//   session.added(id, camera);                                  // those that entered the map
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "fbvins/loop/flight_scale.hpp"
#include "fbvins/loop/odometry_drift.hpp"
#include "fbvins/loop/place_vertical.hpp"
#include "fbvins/loop/readings_since.hpp"
#include "fbvins/loop/recent_motion.hpp"
#include "fbvins/types/keyframe.hpp"

namespace fbvins {

class FlightSession {
 public:
  /// Before the first keyframe of a flight.
  FlightSession() : drift_({}) {}
  /// `number`: counts the sessions of the map. `began_map`: M is its gauge, aligned with gravity. `cameras`: that see places.
  FlightSession(const Keyframe& first, std::uint32_t number, bool began_map, const DriftOptions& drift, std::size_t cameras);

  /// Whether a keyframe is of its gauge.
  bool has(const Keyframe& keyframe) const { return begun_ && keyframe.reset_counter == reset_counter_; }
  bool begun() const { return begun_; }
  std::uint32_t number() const { return number_; }
  bool began_map() const { return began_map_; }

  /// Up to a keyframe. `newest_t`: stamp of newest(), where that is in the map.
  void advance(const Keyframe& keyframe, std::optional<Time> newest_t);
  /// At the last keyframe that it advanced to.
  const GaugeState& gauge() const { return *gauge_; }
  double path_m() const { return path_m_; }
  const DriftOptions& drift() const { return drift_.rate(); }
  const RecentMotion& motion() const { return motion_; }
  /// Of all its lengths together, relatively; 0: its cameras measure them.
  double scale_sigma() const { return scale_.sigma(); }
  /// Whether its lengths are not those of the map, which it did not begin.
  bool needs_scale() const { return !began_map_ && scale_sigma() > 0; }

  /// By which M, or the flight in an older one, is level, and what is known newest; and how well, by gravity and places.
  const Quat& q_LG() const { return q_LG_; }
  const Quat& q_LG_newest() const { return newest_level_.q_LG; }
  double up_sigma_rad() const { return newest_level_.up_sigma_rad; }
  bool is_level() const { return q_LG_newest().coeffs() == q_LG_.coeffs(); }
  LevelledGauge measured_level(const GaugeState& gauge) const { return vertical_.level(gauge); }
  void take_level(const LevelledGauge& level) { newest_level_ = level; }
  void level_by_newest() { q_LG_ = newest_level_.q_LG; }
  /// A place of an older flight says what is upright.
  void see(const MeasuredPose& place) { vertical_.add(*gauge_, place); }

  /// Of its keyframes in the map the newest, of all and of a camera.
  KeyframeId newest() const { return newest_; }
  KeyframeId newest_of(std::size_t camera) const { return newest_of_[camera]; }
  void added(KeyframeId id, std::size_t camera) { newest_ = newest_of_[camera] = id; }
  /// The readings since the newest, up to `t`; those that follow count from `t`.
  std::shared_ptr<const Preintegration> readings_until(Time t, Time newest_t, const KeyframeImu& imu) const {
    return readings_.until(t, newest_t, imu);
  }
  void restart_readings() { readings_.restart(); }

  /// Whether it is localised in the map now. Returns whether it was just found in an older one.
  bool note_localised(bool now) {
    const bool before = std::exchange(localised_, now);
    return now && !before && !began_map_;
  }
  /// Whether a place was where it is expected to be since the flight was found in an older map.
  bool confirmed() const { return confirmed_; }
  void confirm() { confirmed_ = true; }

 private:
  bool begun_ = false, began_map_ = false, localised_ = false, confirmed_ = false;
  std::uint32_t number_ = 0, reset_counter_ = 0;
  std::optional<GaugeState> gauge_;
  double path_m_ = 0;
  OdometryDrift drift_;
  RecentMotion motion_;
  FlightScale scale_;
  PlaceVertical vertical_;
  Quat q_LG_ = Quat::Identity();
  LevelledGauge newest_level_;
  KeyframeId newest_;
  std::vector<KeyframeId> newest_of_;
  ReadingsSince readings_;
};

}  // namespace fbvins
