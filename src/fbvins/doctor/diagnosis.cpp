// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <string_view>

#include "fbvins/doctor/doctor.hpp"

namespace fbvins {
namespace {

std::string counted(std::size_t n, std::string_view what) { return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s"); }

}  // namespace

std::string to_text(const Diagnosis& diagnosis, bool all) {
  std::string text;
  for (const Finding& finding : diagnosis.findings) text += to_text(finding) + '\n';
  if (all)
    for (const std::string& sentence : diagnosis.measured) text += fmt::format("measured: {}\n", sentence);
  for (const std::string& sentence : diagnosis.not_judged) text += fmt::format("not judged: {}\n", sentence);
  const std::size_t findings = diagnosis.findings.size(), gaps = diagnosis.not_judged.size();
  text += fmt::format("{} in {}", findings == 0 ? "nothing wrong" : counted(findings, "finding"),
                      counted(diagnosis.measured.size(), "measurement"));
  if (gaps > 0) text += fmt::format("; {} could not be judged", counted(gaps, "point"));
  return text;
}

}  // namespace fbvins
