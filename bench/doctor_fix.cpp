// SPDX-License-Identifier: Apache-2.0
// The doctor's corrected calibrations, flown (docs/doctor.md): each fault is injected into a good recording, which is diagnosed,
// corrected, and flown as spoilt and as corrected. A recording with a truth.
//
// usage: doctor_fix RECORDING [WORD] [--rows FILE]          each injected fault, or those whose name contains the word
//        doctor_fix RECORDING PART PARTS [--rows FILE]      every PARTS-th fault from the one numbered PART (from 0), for
//                                                            processes side by side
// --rows: appends each row to FILE as well; faults that have one there are left out
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "bench/spoilt_recording.hpp"
#include "fbvins/config/config.hpp"
#include "fbvins/doctor/corrected_rig.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/pipeline/system.hpp"

namespace {

using namespace fbvins;
using namespace fbvins::bench;

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

struct Counts {
  int faults = 0, named = 0, alone = 0, silent = 0, corrected = 0, as_good = 0, worse = 0;
};

void fix_one(const Recorded& good, const Fault& fault, double unspoilt_m, const Rows& rows, Counts& counts) {
  const SetupFault injected = fault();
  StereoRig rig = good.rig;
  if (injected.rig) injected.rig(rig);
  const Replay replay = [&](const TakeEvent& take) { return play(good, fault, rig.time_offset_s, take); };
  const Diagnosis diagnosis = *diagnose(rig, replay, CalibrationStyle::kalibr);
  const Finding* named = nullptr;
  bool alone = true;
  for (const Finding& finding : diagnosis.findings)
    if (finding.kind == injected.kind) named = &finding;
    else alone = false;
  const bool sized = named != nullptr && (injected.size == 0 || std::abs(named->size - injected.size) <= injected.tolerance);
  ++counts.faults, counts.named += sized, counts.alone += sized && alone, counts.silent += diagnosis.findings.empty();
  std::string verdict = sized                        ? alone ? "named" : "named, others too"
                        : named != nullptr           ? "wrong size"
                        : diagnosis.findings.empty() ? "silent"
                                                     : "other name";
  if (named != nullptr) verdict += fmt::format(", {:.4g} +- {:.2g} {}", named->size, named->sigma, named->unit);
  const CorrectedRig corrected = *correct_rig(rig, diagnosis, replay, CalibrationStyle::kalibr);
  std::string flight = fmt::format(" | not written: {}", corrected.why_not);
  if (corrected.rig) {
    const double spoilt_m = flown(good, fault, rig);
    const double corrected_m = flown(good, fault, *corrected.rig);
    const bool worse = corrected_m > 1.02 * spoilt_m + 1e-3, as_good = corrected_m <= 1.1 * unspoilt_m + 1e-3;
    ++counts.corrected, counts.as_good += as_good, counts.worse += worse;
    flight = fmt::format("{} | {}{}, then {}", mm(spoilt_m), mm(corrected_m),
                         worse     ? " WORSE"
                         : as_good ? " as unspoilt"
                                   : "",
                         kinds(corrected.after.findings));
  }
  std::string row = fmt::format("| {} | {} | {} | {} |\n", injected.name, kinds(diagnosis.findings), verdict, flight);
  if (!sized || !alone) {
    for (const Finding& finding : diagnosis.findings) row += fmt::format("  {}\n", to_text(finding));
    for (const std::string& text : diagnosis.measured) row += fmt::format("    {}\n", text);
  }
  rows.add(row);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  const Rows rows(arguments);
  if (arguments.empty()) return fmt::print(stderr, "usage: doctor_fix RECORDING [WORD | PART PARTS] [--rows FILE]\n"), 2;
  const Result<Recorded> good = record(arguments[0]);
  if (!good) return fmt::print(stderr, "{}\n", good.error().message), 2;
  const bool in_parts = arguments.size() > 2;
  const std::string word = arguments.size() > 1 && !in_parts ? arguments[1] : "";
  const std::size_t part = in_parts ? std::stoul(arguments[1]) : 0;
  const std::size_t parts = in_parts ? std::max(1ul, std::stoul(arguments[2])) : 1;
  const std::vector<SetupFault> all = setup_faults(good->rig);
  const double unspoilt_m = flown(
      *good, [] { return SetupFault{}; }, good->rig);
  fmt::print("unspoilt: {} mm\n| fault | found | verdict | ATE spoilt, mm | corrected, mm |\n|---|---|---|---|---|\n",
             mm(unspoilt_m));
  Counts counts;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (i % parts == part && all[i].name.find(word) != std::string::npos && !rows.has(all[i].name))
      fix_one(
          *good, [&good, i] { return setup_faults(good->rig)[i]; }, unspoilt_m, rows, counts);
  fmt::print(
      "{} faults: {} named with the right size, {} of them alone; {} silent; {} corrected, {} of them as good as unspoilt, {} worse than spoilt\n",
      counts.faults, counts.named, counts.alone, counts.silent, counts.corrected, counts.as_good, counts.worse);
  return counts.worse > 0;
}
