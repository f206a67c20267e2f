// SPDX-License-Identifier: Apache-2.0
#include "tests/robustness/altered_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fbvins::test {
namespace {

void compare_with_truth(const std::vector<TrajectoryPoint>& points, Flown& flown) {
  Trajectory<W> truth, estimate;
  std::map<Time, FrameId> id;
  for (const TrajectoryPoint& p : points) truth.push_back({p.t, p.T_WB});
  for (const Odometry& o : flown.odometry) {
    if (!o.health.has_pose()) continue;
    estimate.push_back({o.t, o.T_WB});
    id[o.t] = o.id;
  }
  const std::vector<PosePair> pairs = associate(truth, estimate, {.method = AssociationMethod::interpolate_truth});
  const auto alignment = align(pairs, Alignment::se3);
  if (!alignment) return;
  for (const PosePair& pair : pairs)
    flown.error_m[id[pair.estimate.t]] = ((*alignment * pair.estimate.T).p - pair.truth.T.p).norm();
}

}  // namespace

double Flown::rmse_m(double from_s, double to_s) const {
  double sum = 0;
  int n = 0;
  for (const Odometry& o : odometry) {
    const auto error = error_m.find(o.id);
    if (error == error_m.end() || time_s(o) < from_s || time_s(o) > to_s) continue;
    sum += error->second * error->second;
    ++n;
  }
  return n > 0 ? std::sqrt(sum / n) : INFINITY;
}

double Flown::largest_error_of_good_m() const {
  double largest = 0;
  for (const Odometry& o : odometry)
    if (const auto error = error_m.find(o.id); error != error_m.end() && o.health.state == HealthState::good)
      largest = std::max(largest, error->second);
  return largest;
}

int Flown::with_pose() const {
  return static_cast<int>(std::count_if(odometry.begin(), odometry.end(), [](const Odometry& o) { return o.health.has_pose(); }));
}

int Flown::count(HealthState state, double from_s, double to_s) const {
  return static_cast<int>(std::count_if(odometry.begin(), odometry.end(), [&](const Odometry& o) {
    return o.health.state == state && time_s(o) >= from_s && time_s(o) <= to_s;
  }));
}

std::string Flown::text() const {
  std::map<std::string, int> health;
  for (const Odometry& o : odometry) ++health[fmt::format("{}/{}", to_string(o.health.state), to_string(o.health.reason))];
  std::string line = fmt::format("rmse {:.4f} m, largest of good {:.4f} m, {} poses, {} resets;", rmse_m(),
                                 largest_error_of_good_m(), with_pose(), resets());
  for (const auto& [name, frames] : health) line += fmt::format(" {} {}", name, frames);
  return line;
}

SystemOptions config_for(const std::string& frontend) {
  SystemOptions config;
  config.frontend.kind = frontend;
  return config;
}

Flown fly(const std::filesystem::path& recording, const SystemOptions& config, const Alter& alter,
          const std::function<void(StereoRig&)>& miscalibrate) {
  auto data = open_dataset(recording.string());
  if (!data) throw std::runtime_error(data.error().message);
  Flown flown;
  flown.images = static_cast<int>((*data)->frames().size());
  flown.start = (*data)->frames().front().t;
  StereoRig rig = (*data)->rig();
  if (miscalibrate) miscalibrate(rig);
  Result<System> system = System::create(config, rig);
  if (!system) throw std::runtime_error(system.error().message);
  system->on_odometry([&](const Odometry& o) { flown.odometry.push_back(o); });
  while (auto event = (*data)->next()) {
    const Time t = stamp_of(*event);
    if (alter && !alter((t - flown.start).seconds(), *event)) continue;
    if (!system->push(std::move(*event))) break;
  }
  if (auto end = system->finish(); !end) throw std::runtime_error(end.error().message);
  flown.calibration = system->calibration();
  compare_with_truth((*data)->ground_truth(), flown);
  return flown;
}

}  // namespace fbvins::test
