// SPDX-License-Identifier: Apache-2.0
// The flight so far in bounded memory, for pages that are opened in mid-flight. One thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "fbvins/live/live_event.hpp"
#include "fbvins/web/thinned.hpp"

namespace fbvins {

struct PathPoint {
  double t_s = 0;
  Vec3 p_W = Vec3::Zero();
  std::uint32_t reset_counter = 0;
};

struct HealthChange {
  double t_s = 0;
  Health health;
};

struct FlightMark {
  double t_s = 0;
  std::string text;
};

/// The plots' values at one image.
struct SeriesPoint {
  double t_s = 0;
  double latency_ms = -1;  ///< negative: not known
  double sigma_m = -1;     ///< likewise
  int features = 0, landmarks = 0;
  std::int64_t dropped = 0;  ///< images, since the start
};

/// Last known positions of landmarks, by track; the oldest are dropped when it is full.
class PointCloud {
 public:
  static constexpr std::size_t kMost = 20'000;
  void add(const LiveView::Landmark& landmark);
  void clear() { points_.clear(), places_.clear(), oldest_ = 0; }
  const std::vector<LiveView::Landmark>& points() const { return points_; }

 private:
  std::vector<LiveView::Landmark> points_;
  std::unordered_map<std::int64_t, std::size_t> places_;  ///< by track
  std::size_t oldest_ = 0;                                ///< the next one to be replaced when it is full
};

class FlightHistory {
 public:
  /// `view`: of the same image, or null. `t_s`: since the start of the flight.
  void add(double t_s, const Odometry& odometry, const LiveView* view);
  void add(double t_s, const LiveMark& mark);
  void dropped_images(std::int64_t count) { dropped_ = count; }
  void clear();

  double distance_m() const { return distance_m_; }
  const std::vector<PathPoint>& path() const { return path_.values(); }
  const std::vector<SeriesPoint>& series() const { return series_.values(); }
  const std::deque<HealthChange>& health() const { return health_; }
  const std::deque<FlightMark>& marks() const { return marks_; }
  const PointCloud& cloud() const { return cloud_; }
  const SeriesPoint& newest() const { return newest_; }

 private:
  Thinned<PathPoint> path_{6000};
  Thinned<SeriesPoint> series_{1500};
  std::deque<HealthChange> health_;
  std::deque<FlightMark> marks_;
  PointCloud cloud_;
  std::optional<PathPoint> last_;
  SeriesPoint newest_;
  double distance_m_ = 0;
  std::int64_t dropped_ = 0;
};

/// Standard deviation of the position over all axes: the square root of the position covariance's trace.
double position_sigma_m(const Mat6& pose_covariance);

}  // namespace fbvins
