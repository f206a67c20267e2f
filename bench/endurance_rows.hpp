// SPDX-License-Identifier: Apache-2.0
// What bench/endurance.cpp prints of an interval: memory, processor time and errors.
#pragma once

#include <time.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <vector>

#include "fbvins/eval/alignment.hpp"
#include "fbvins/eval/statistics.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins::bench {

inline constexpr double kImageRate_hz = 20, kDrift_s = 10;

inline double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

inline double resident_mb() {
  double pages = 0;
  std::ifstream("/proc/self/statm") >> pages >> pages;
  return pages * 4096 / 1e6;
}

/// Processor time that the simulation takes within calls of the odometry.
inline double simulation_ms = 0;
class Simulating {
 public:
  ~Simulating() { simulation_ms += cpu_ms() - begin_; }

 private:
  double begin_ = cpu_ms();
};

struct Row {
  double hours = 0, memory_mb = 0, mean_ms = 0, p99_ms = 0, map_error_m = 0, drift_m = 0;
};

/// Errors and times of an interval.
class Interval {
 public:
  void take(const Odometry& o, const Pose<W, B>& truth, const std::optional<Pose<M, W>>& T_MW) {
    resets = o.reset_counter;
    if (!o.health.has_pose()) return;
    ++poses;
    recent_.push_back({o.T_WB, truth, o.reset_counter});
    if (recent_.size() > static_cast<std::size_t>(kDrift_s * kImageRate_hz)) {
      const Past& past = recent_.front();
      if (past.reset_counter == o.reset_counter)
        add(((past.estimate.inverse() * o.T_WB).p - (past.truth.inverse() * truth).p).norm(), drift2_, drifts_);
      recent_.erase(recent_.begin());
    }
    if (!T_MW) return;
    const Pose<M, B> T_MB = *T_MW * o.T_WB;
    const PosePair pair{{o.t, truth.cast_frames<AnyWorld, B>()}, {o.t, T_MB.cast_frames<AnyWorld, B>()}};
    if (!to_truth_) first_.push_back(pair);
    else add(((*to_truth_ * T_MB).p - truth.p).norm(), error2_, errors_);
  }
  void took(double ms) { ms_.push_back(ms); }

  /// Fixes the map's place in the world by the poses until now.
  void align_map(bool still) {
    if (to_truth_ || first_.size() < 100) return;
    const auto aligned = still ? align_start(first_) : align(first_, Alignment::yaw);
    if (aligned) to_truth_ = *aligned;
    first_ = {};
  }

  Row row(double hours) const {
    double sum = 0;
    for (const double ms : ms_) sum += ms;
    return {hours,
            resident_mb(),
            sum / static_cast<double>(ms_.size()),
            percentile(ms_, 0.99),
            std::sqrt(error2_ / std::max(1.0, errors_)),
            std::sqrt(drift2_ / std::max(1.0, drifts_))};
  }
  void begin() {
    ms_.clear();
    drift2_ = drifts_ = error2_ = errors_ = 0;
    poses = 0;
  }

  std::int64_t poses = 0;
  std::uint32_t resets = 0;

 private:
  struct Past {
    Pose<W, B> estimate, truth;
    std::uint32_t reset_counter;
  };
  static void add(double error, double& sum2, double& count) { sum2 += error * error, ++count; }

  std::vector<double> ms_;
  std::vector<Past> recent_;
  std::vector<PosePair> first_;
  std::optional<Similarity> to_truth_;
  double drift2_ = 0, drifts_ = 0, error2_ = 0, errors_ = 0;
};

}  // namespace fbvins::bench
