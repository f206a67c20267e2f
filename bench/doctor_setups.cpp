// SPDX-License-Identifier: Apache-2.0
// The doctor's table (docs/doctor.md): good recordings, in which it must find nothing, and faults injected into them.
//
// usage: doctor_setups good RECORDING...          findings and measurements of each
//        doctor_setups wrong RECORDING [WORD]     each injected fault, or those whose name contains the word
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "fbvins/doctor/doctor.hpp"
#include "fbvins/doctor/gather.hpp"
#include "fbvins/doctor/spoilers.hpp"
#include "fbvins/io/dataset.hpp"

namespace {

using namespace fbvins;

Result<Evidence> gather(const std::string& path, const Spoiler* spoiler) {
  auto data = open_dataset(path);
  if (!data) return data.error();
  StereoRig rig = (*data)->rig();
  if (spoiler != nullptr && spoiler->rig) spoiler->rig(rig);
  EvidenceGatherer gatherer(rig);
  while (auto event = (*data)->next()) {
    if (auto* sample = std::get_if<ImuSample>(&*event); sample && spoiler != nullptr) {
      if (spoiler->lost && spoiler->lost(*sample)) continue;
      if (spoiler->reading) spoiler->reading(*sample);
    }
    if (auto* frame = std::get_if<StereoFrame>(&*event); frame && spoiler != nullptr && spoiler->frame) spoiler->frame(*frame);
    if (!gatherer.push(*event)) break;
  }
  return gatherer.finish();
}

void print_all(const Diagnosis& diagnosis) {
  for (const std::string& text : diagnosis.measured) fmt::print("    {}\n", text);
  for (const std::string& text : diagnosis.not_judged) fmt::print("    not judged: {}\n", text);
}

int good(int count, char** paths) {
  int alarms = 0;
  for (int i = 0; i < count; ++i) {
    const auto evidence = gather(paths[i], nullptr);
    if (!evidence) return fmt::print(stderr, "{}\n", evidence.error().message), 2;
    const Diagnosis diagnosis = examine(*evidence);
    fmt::print("| {} | {} | {} |\n", paths[i], diagnosis.findings.size(), diagnosis.not_judged.size());
    for (const Finding& finding : diagnosis.findings) fmt::print("  {}\n", to_text(finding));
    print_all(diagnosis);
    std::fflush(stdout);
    alarms += static_cast<int>(diagnosis.findings.size());
  }
  return alarms > 0;
}

std::string kinds(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings) text += std::string(text.empty() ? "" : ", ") + std::string(to_string(finding.kind));
  return text;
}

int wrong(const std::string& path, std::string_view word) {
  const auto clean = gather(path, nullptr);
  if (!clean) return fmt::print(stderr, "{}\n", clean.error().message), 2;
  int failed = 0;
  for (Spoiler& spoiler : spoilers(clean->rig)) {
    if (spoiler.name.find(word) == std::string::npos) continue;
    Evidence evidence = *clean;
    if (spoiler.rig || spoiler.frame) evidence = *gather(path, &spoiler);
    if (!spoiler.rig && !spoiler.frame) {
      if (spoiler.lost) std::erase_if(evidence.imu, spoiler.lost);
      for (ImuSample& sample : evidence.imu)
        if (spoiler.reading) spoiler.reading(sample);
    }
    const Diagnosis diagnosis = examine(evidence);
    const Finding* named = nullptr;
    for (const Finding& finding : diagnosis.findings)
      if (finding.kind == spoiler.kind) named = &finding;
    const bool sized = named != nullptr && (spoiler.size == 0 || std::abs(named->size - spoiler.size) <= spoiler.tolerance);
    const bool only = named != nullptr && std::all_of(diagnosis.findings.begin(), diagnosis.findings.end(),
                                                      [&](const Finding& f) { return f.kind == spoiler.kind; });
    failed += !sized;
    fmt::print("| {} | {} | {} | {} | {} | {} |\n", spoiler.name, kinds(diagnosis.findings),
               named == nullptr ? "MISSED"
               : only           ? "named"
                                : "named, others too",
               spoiler.size == 0 ? "" : fmt::format("{:.4g} +- {:.4g}", spoiler.size, spoiler.tolerance),
               named == nullptr ? "" : fmt::format("{:.4g} +- {:.2g} {}", named->size, named->sigma, named->unit),
               sized ? "ok" : "WRONG");
    if (!sized || !only) {
      for (const Finding& finding : diagnosis.findings) fmt::print("  {}\n", to_text(finding));
      print_all(diagnosis);
    }
    std::fflush(stdout);
  }
  return failed > 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc >= 3 && argv[1] == std::string_view("good")) return good(argc - 2, argv + 2);
  if (argc >= 3 && argv[1] == std::string_view("wrong")) return wrong(argv[2], argc > 3 ? argv[3] : "");
  fmt::print(stderr, "usage: doctor_setups good RECORDING... | wrong RECORDING [WORD]\n");
  return 2;
}
