// SPDX-License-Identifier: Apache-2.0
// The doctor's corrected calibrations, flown (docs/doctor.md): each fault is injected into a good recording, which is diagnosed,
// mended, and flown as spoilt and as mended. A recording with a truth.
//
// usage: doctor_mend RECORDING [WORD]          each injected fault, or those whose name contains the word
//        doctor_mend RECORDING PART PARTS      every PARTS-th fault from the one numbered PART (from 0), for processes side by
//        side
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string_view>

#include "fbvins/config/config.hpp"
#include "fbvins/doctor/mend.hpp"
#include "fbvins/doctor/spoilers.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/pipeline/system.hpp"

namespace {

using namespace fbvins;

/// All of a recording, in memory.
struct Recorded {
  StereoRig rig;
  std::vector<ImuSample> readings;
  std::vector<StereoFrame> frames;
  Trajectory<W> truth;
};

Result<Recorded> record(const std::string& path) {
  auto data = open_dataset(path);
  if (!data) return data.error();
  Recorded out;
  out.rig = (*data)->rig();
  while (auto event = (*data)->next()) {
    if (auto* sample = std::get_if<ImuSample>(&*event)) out.readings.push_back(*sample);
    else out.frames.push_back(std::get<StereoFrame>(*event));
  }
  for (const TrajectoryPoint& p : (*data)->ground_truth()) out.truth.push_back({p.t, p.T_WB});
  return out;
}

/// A fault with its own state; none spoils nothing.
using Fault = std::function<Spoiler()>;

/// The events of a spoilt recording in the order in which a rig with this time offset gets them.
Result<void> play(const Recorded& good, const Fault& fault, double offset_s, const TakeEvent& take) {
  const Spoiler spoil = fault();
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

constexpr double kNoPose = std::numeric_limits<double>::infinity();
/// Share of the images without a pose from which a flight counts as none: the error of the rest says nothing.
constexpr double kMostWithoutPose = 0.5;

/// Absolute trajectory error, m.
double flown(const Recorded& good, const Fault& fault, const StereoRig& rig) {
  Config config;
  config.frontend.kind = "klt";
  Result<System> system = System::create(config, rig);
  if (!system) return kNoPose;
  Trajectory<W> estimate;
  system->on_odometry([&](const Odometry& o) {
    if (o.health.has_pose()) estimate.push_back({o.t, o.T_WB});
  });
  const Result<void> played =
      play(good, fault, rig.time_offset_s, [&](SensorEvent event) { return system->push(std::move(event)).ok(); });
  const Result<void> ended = system->finish();
  if (!played || !ended || static_cast<double>(estimate.size()) < kMostWithoutPose * static_cast<double>(good.frames.size()))
    return kNoPose;
  const auto e = evaluate(good.truth, estimate, {});
  return e ? e->absolute_m.rmse : kNoPose;
}

std::string mm(double error_m) { return std::isfinite(error_m) ? fmt::format("{:.1f}", 1e3 * error_m) : "no pose"; }

std::string kinds(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings) text += std::string(text.empty() ? "" : ", ") + std::string(to_string(finding.kind));
  return text.empty() ? "nothing" : text;
}

struct Counts {
  int faults = 0, named = 0, alone = 0, silent = 0, mended = 0, as_good = 0, worse = 0;
};

void mend_one(const Recorded& good, const Fault& fault, double unspoilt_m, Counts& counts) {
  const Spoiler spoiler = fault();
  StereoRig rig = good.rig;
  if (spoiler.rig) spoiler.rig(rig);
  const Replay replay = [&](const TakeEvent& take) { return play(good, fault, rig.time_offset_s, take); };
  const Diagnosis diagnosis = *diagnose(rig, replay, CalibrationStyle::kalibr);
  const Finding* named = nullptr;
  bool alone = true;
  for (const Finding& finding : diagnosis.findings)
    if (finding.kind == spoiler.kind) named = &finding;
    else alone = false;
  const bool sized = named != nullptr && (spoiler.size == 0 || std::abs(named->size - spoiler.size) <= spoiler.tolerance);
  ++counts.faults, counts.named += sized, counts.alone += sized && alone, counts.silent += diagnosis.findings.empty();
  std::string verdict = sized                        ? alone ? "named" : "named, others too"
                        : named != nullptr           ? "wrong size"
                        : diagnosis.findings.empty() ? "silent"
                                                     : "other name";
  if (named != nullptr) verdict += fmt::format(", {:.4g} +- {:.2g} {}", named->size, named->sigma, named->unit);
  const Mended mended = *mend(rig, diagnosis, replay, CalibrationStyle::kalibr);
  std::string flight = fmt::format(" | not written: {}", mended.why_not);
  if (mended.rig) {
    const double spoilt_m = flown(good, fault, rig);
    const double mended_m = flown(good, fault, *mended.rig);
    const bool worse = mended_m > 1.02 * spoilt_m + 1e-3;
    ++counts.mended, counts.as_good += mended_m <= 1.1 * unspoilt_m + 1e-3, counts.worse += worse;
    flight = fmt::format("{} | {}{}, then {}", mm(spoilt_m), mm(mended_m), worse ? " WORSE" : "", kinds(mended.after.findings));
  }
  fmt::print("| {} | {} | {} | {} |\n", spoiler.name, kinds(diagnosis.findings), verdict, flight);
  if (!sized || !alone)
    for (const Finding& finding : diagnosis.findings) fmt::print("  {}\n", to_text(finding));
  if (!sized || !alone)
    for (const std::string& text : diagnosis.measured) fmt::print("    {}\n", text);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return fmt::print(stderr, "usage: doctor_mend RECORDING [WORD | PART PARTS]\n"), 2;
  const Result<Recorded> good = record(argv[1]);
  if (!good) return fmt::print(stderr, "{}\n", good.error().message), 2;
  const bool in_parts = argc > 3;
  const std::string_view word = argc > 2 && !in_parts ? argv[2] : "";
  const std::size_t part = in_parts ? std::strtoul(argv[2], nullptr, 10) : 0;
  const std::size_t parts = in_parts ? std::max(1ul, std::strtoul(argv[3], nullptr, 10)) : 1;
  const std::vector<Spoiler> all = spoilers(good->rig);
  const double unspoilt_m = flown(
      *good, [] { return Spoiler{}; }, good->rig);
  fmt::print("unspoilt: {} mm\n| fault | found | verdict | ATE spoilt, mm | mended, mm |\n|---|---|---|---|---|\n",
             mm(unspoilt_m));
  Counts counts;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (i % parts == part && all[i].name.find(word) != std::string::npos)
      mend_one(
          *good, [&good, i] { return spoilers(good->rig)[i]; }, unspoilt_m, counts);
  fmt::print(
      "{} faults: {} named with the right size, {} of them alone; {} silent; {} mended, {} of them as good as unspoilt, {} worse than spoilt\n",
      counts.faults, counts.named, counts.alone, counts.silent, counts.mended, counts.as_good, counts.worse);
  return counts.worse > 0;
}
