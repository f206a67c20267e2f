// SPDX-License-Identifier: Apache-2.0
// The doctor's table (docs/doctor.md): good recordings, in which it must find nothing, and faults injected into them.
//
// usage: doctor_setups good RECORDING...          findings and measurements of each
//        doctor_setups wrong RECORDING [WORD] [--rows FILE]
//                                                 each injected fault, or those whose name contains the word, compared with
//                                                 common mistakes as `fbvins doctor` does; rows are appended to FILE as well, and
//                                                 faults that have one there are left out
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "bench/spoilt_recording.hpp"
#include "fbvins/doctor/collect.hpp"
#include "fbvins/doctor/common_mistakes.hpp"

namespace {

using namespace fbvins;
using namespace fbvins::bench;

Result<Evidence> collect(const std::string& path) {
  auto data = open_dataset(path);
  if (!data) return data.error();
  EvidenceCollector gatherer((*data)->rig());
  while (auto event = (*data)->next())
    if (!gatherer.push(*event)) break;
  return gatherer.finish();
}

std::string all_of(const Diagnosis& diagnosis) {
  std::string out;
  for (const Finding& finding : diagnosis.findings) out += fmt::format("  {}\n", to_text(finding));
  for (const std::string& text : diagnosis.measured) out += fmt::format("    {}\n", text);
  for (const std::string& text : diagnosis.not_judged) out += fmt::format("    not judged: {}\n", text);
  return out;
}

int good(int count, char** paths) {
  int alarms = 0;
  for (int i = 0; i < count; ++i) {
    const auto evidence = collect(paths[i]);
    if (!evidence) return fmt::print(stderr, "{}\n", evidence.error().message), 2;
    const Diagnosis diagnosis = examine(*evidence);
    fmt::print("| {} | {} | {} |\n", paths[i], diagnosis.findings.size(), diagnosis.not_judged.size());
    fmt::print("{}", all_of(diagnosis));
    std::fflush(stdout);
    alarms += static_cast<int>(diagnosis.findings.size());
  }
  return alarms > 0;
}

/// Where only readings are spoilt the images are not looked at again, unless something is very wrong.
Diagnosis diagnosed(const Recorded& good, const Evidence& clean, const Fault& fault) {
  const SetupFault injected = fault();
  if (!injected.rig && !injected.frame) {
    Evidence evidence = clean;
    if (injected.lost) std::erase_if(evidence.imu, injected.lost);
    for (ImuSample& sample : evidence.imu)
      if (injected.reading) injected.reading(sample);
    Diagnosis as_given = examine(evidence);
    if (!is_strange(as_given)) return as_given;
  }
  StereoRig rig = good.rig;
  if (injected.rig) injected.rig(rig);
  const Replay replay = [&](const TakeEvent& take) { return play(good, fault, rig.time_offset_s, take); };
  return *diagnose(rig, replay, CalibrationStyle::kalibr);
}

/// Whether it is named with the right size.
bool judge(const Recorded& good, const Evidence& clean, const Fault& fault, const Rows& rows) {
  const SetupFault injected = fault();
  const Diagnosis diagnosis = diagnosed(good, clean, fault);
  const Finding* named = nullptr;
  for (const Finding& finding : diagnosis.findings)
    if (finding.kind == injected.kind) named = &finding;
  const bool sized = named != nullptr && (injected.size == 0 || std::abs(named->size - injected.size) <= injected.tolerance);
  const bool only =
      named != nullptr && std::ranges::all_of(diagnosis.findings, [&](const Finding& f) { return f.kind == injected.kind; });
  std::string row = fmt::format(
      "| {} | {} | {} | {} | {} | {} |\n", injected.name, kinds(diagnosis.findings),
      named == nullptr ? "MISSED"
      : only           ? "named"
                       : "named, others too",
      injected.size == 0 ? "" : fmt::format("{:.4g} +- {:.4g}", injected.size, injected.tolerance),
      named == nullptr ? "" : fmt::format("{:.4g} +- {:.2g} {}", named->size, named->sigma, named->unit), sized ? "ok" : "WRONG");
  if (!sized || !only) row += all_of(diagnosis);
  rows.add(row);
  return sized;
}

int wrong(const std::string& path, const std::string& word, const Rows& rows) {
  const Result<Recorded> good = record(path);
  if (!good) return fmt::print(stderr, "{}\n", good.error().message), 2;
  const auto clean = collect(path);
  if (!clean) return fmt::print(stderr, "{}\n", clean.error().message), 2;
  const std::vector<SetupFault> all = setup_faults(good->rig);
  bool failed = false;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (all[i].name.find(word) != std::string::npos && !rows.has(all[i].name))
      failed |= !judge(
          *good, *clean, [&good, i] { return setup_faults(good->rig)[i]; }, rows);
  return failed;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  const Rows rows(arguments);
  const std::string mode = arguments.size() > 1 ? arguments[0] : "";
  if (mode == "good") return good(argc - 2, argv + 2);
  if (mode == "wrong") return wrong(arguments[1], arguments.size() > 2 ? arguments[2] : "", rows);
  fmt::print(stderr, "usage: doctor_setups good RECORDING... | wrong RECORDING [WORD] [--rows FILE]\n");
  return 2;
}
