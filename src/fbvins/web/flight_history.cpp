// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/flight_history.hpp"

#include <cmath>

namespace fbvins {
namespace {

constexpr std::size_t kMostHealthChanges = 2000, kMostMarks = 200;

template <class T>
void push_bounded(std::deque<T>& values, T value, std::size_t most) {
  if (values.size() >= most) values.pop_front();
  values.push_back(std::move(value));
}

}  // namespace

double position_sigma_m(const Mat6& pose_covariance) { return std::sqrt(pose_covariance.topLeftCorner<3, 3>().trace()); }

void PointCloud::add(const LiveView::Landmark& landmark) {
  const auto [place, is_new] = places_.try_emplace(landmark.track.value, points_.size());
  if (!is_new) {
    points_[place->second] = landmark;
  } else if (points_.size() < kMost) {
    points_.push_back(landmark);
  } else {
    places_.erase(points_[oldest_].track.value);
    place->second = oldest_;
    points_[oldest_] = landmark;
    oldest_ = (oldest_ + 1) % kMost;
  }
}

void FlightHistory::add(double t_s, const Odometry& o, const LiveView* view) {
  if (health_.empty() || !(health_.back().health == o.health))
    push_bounded(health_, HealthChange{t_s, o.health}, kMostHealthChanges);
  newest_ = {
      t_s,     view ? view->shutter_to_pose_ms : -1, -1, view ? static_cast<int>(view->features.size()) : 0, o.stats.landmarks,
      dropped_};
  if (o.health.has_pose()) {
    const PathPoint point{t_s, o.T_WB.p, o.reset_counter};
    const bool goes_on = last_ && last_->reset_counter == point.reset_counter;
    if (goes_on) distance_m_ += (point.p_W - last_->p_W).norm();
    else cloud_.clear();  // W is another frame
    last_ = point;
    path_.push(point);
    newest_.sigma_m = position_sigma_m(o.pose_covariance);
    if (view)
      for (const LiveView::Landmark& landmark : view->landmarks) cloud_.add(landmark);
  }
  series_.push(newest_);
}

void FlightHistory::add(double t_s, const LiveMark& mark) { push_bounded(marks_, FlightMark{t_s, mark.text}, kMostMarks); }

void FlightHistory::clear() {
  path_.clear(), series_.clear(), health_.clear(), marks_.clear(), cloud_.clear();
  last_.reset();
  distance_m_ = 0, dropped_ = 0;
}

}  // namespace fbvins
