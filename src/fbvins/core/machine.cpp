// SPDX-License-Identifier: Apache-2.0
#include "fbvins/core/machine.hpp"

#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <fstream>
#include <string>
#include <thread>

namespace fbvins {

std::string describe_machine() {
  std::string processor = "unknown processor";
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);)
    if (const auto colon = line.find(": "); line.starts_with("model name") && colon != std::string::npos) {
      processor = line.substr(colon + 2);
      break;
    }
  utsname system{};
  uname(&system);
  const double gigabytes =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE)) / (1024.0 * 1024 * 1024);
  return fmt::format("{}, {} cores, {:.0f} GB, {} {} {}", processor, std::thread::hardware_concurrency(), gigabytes,
                     system.sysname, system.release, system.machine);
}

}  // namespace fbvins
