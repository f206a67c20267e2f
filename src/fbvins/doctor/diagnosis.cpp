// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <string_view>

#include "fbvins/doctor/doctor.hpp"

namespace fbvins {
namespace {

/// What no recording shows, by the sizes from which findings are reported (docs/doctor.md).
constexpr std::string_view kNotSeen =
    "not seen: errors below 3 ms, 1 degree of the mounting and 5 cm of its position, 3 % of the baseline, 5 % of both focal lengths "
    "alike, 3 % of a scale, 0.1 rad/s or 1 m/s^2 of a bias; noise figures that some IMU has; readings missing for less than 0.05 s and 2 % in all, or filled by interpolation\n";

std::string counted(std::size_t n, std::string_view what) { return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s"); }

}  // namespace

std::string to_text(const Diagnosis& diagnosis, bool all) {
  std::string text;
  for (const Finding& finding : diagnosis.findings) text += to_text(finding) + '\n';
  if (all)
    for (const std::string& sentence : diagnosis.measured) text += fmt::format("measured: {}\n", sentence);
  for (const std::string& sentence : diagnosis.not_judged) text += fmt::format("not judged: {}\n", sentence);
  if (!diagnosis.measured.empty()) text += kNotSeen;
  const std::size_t findings = diagnosis.findings.size(), gaps = diagnosis.not_judged.size();
  if (findings == 0 && !diagnosis.no_verdict.empty()) return text + "no verdict: " + diagnosis.no_verdict;
  text += fmt::format("{} in {}", findings == 0 ? "nothing wrong" : counted(findings, "finding"),
                      counted(diagnosis.measured.size(), "measurement"));
  if (gaps > 0) text += fmt::format("; {} could not be judged", counted(gaps, "point"));
  return text;
}

}  // namespace fbvins
