// SPDX-License-Identifier: Apache-2.0
// Recordings that faults are injected into, and tables of what became of each fault, which a run that was interrupted goes on
// with.
#pragma once

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "fbvins/doctor/diagnose.hpp"
#include "fbvins/io/dataset.hpp"
#include "tests/support/setup_faults.hpp"

namespace fbvins::bench {

/// All of a recording, in memory.
struct Recorded {
  StereoRig rig;
  std::vector<ImuSample> readings;
  std::vector<StereoFrame> frames;
  Trajectory<W> truth;
};

inline Result<Recorded> record(const std::string& path) {
  auto data = open_dataset(path);
  if (!data) return data.error();
  Recorded out;
  out.rig = (*data)->rig();
  while (auto event = (*data)->next()) {
    std::visit(Overloaded{[&](const ImuSample& sample) { out.readings.push_back(sample); }, [](const AidingSample&) {},
                          [&](StereoFrame& frame) { out.frames.push_back(std::move(frame)); }},
               *event);
  }
  for (const TrajectoryPoint& p : (*data)->ground_truth()) out.truth.push_back({p.t, p.T_WB});
  return out;
}

/// A fault with its own state; none spoils nothing.
using Fault = std::function<SetupFault()>;

/// The events of a spoilt recording in the order in which a rig with this time offset gets them.
inline Result<void> play(const Recorded& good, const Fault& fault, double offset_s, const TakeEvent& take) {
  const SetupFault spoil = fault();
  std::vector<ImuSample> readings = good.readings;
  if (spoil.lost) std::erase_if(readings, spoil.lost);
  if (spoil.reading && !spoil.frame)
    for (ImuSample& sample : readings) spoil.reading(sample);
  std::size_t next = 0;
  const auto hand_on = [&](ImuSample sample) {
    if (spoil.reading && spoil.frame) spoil.reading(sample);  // which depend on one another
    return take(sample);
  };
  for (StereoFrame frame : good.frames) {
    while (next < readings.size() && (next == 0 || readings[next - 1].t < frame.t + Duration::from_seconds(offset_s)))
      if (!hand_on(readings[next++])) return {};
    if (spoil.frame) spoil.frame(frame);
    if (!take(std::move(frame))) return {};
  }
  while (next < readings.size())
    if (!hand_on(readings[next++])) return {};
  return {};
}

inline std::string kinds(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings) text += std::string(text.empty() ? "" : ", ") + std::string(to_string(finding.kind));
  return text.empty() ? "nothing" : text;
}

/// Rows of a table by the name of the fault, printed and appended to a file, where there is one.
class Rows {
 public:
  /// Takes `--rows FILE` out of the arguments.
  explicit Rows(std::vector<std::string>& arguments) {
    const auto at = std::ranges::find(arguments, "--rows");
    if (at == arguments.end() || at + 1 == arguments.end()) return;
    path_ = at[1];
    arguments.erase(at, at + 2);
    std::ifstream in(path_);
    for (std::string line; std::getline(in, line);)
      if (line.starts_with("| ")) there_.insert(line.substr(2, line.find(" |") - 2));
  }
  /// Written by a run before this one.
  bool has(const std::string& name) const { return there_.contains(name); }
  void add(const std::string& text) const {
    std::fputs(text.c_str(), stdout);
    std::fflush(stdout);
    if (!path_.empty()) std::ofstream(path_, std::ios::app) << text;
  }

 private:
  std::string path_;
  std::set<std::string> there_;
};

}  // namespace fbvins::bench
