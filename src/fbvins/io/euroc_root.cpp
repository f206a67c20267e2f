// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/euroc_root.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <vector>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

Result<std::string> find_root(const FileSource& files, const std::string& path) {
  std::vector<std::string> roots;
  for (int i = 0; i < kMostCameras && roots.empty(); ++i) roots = files.folders_holding(fmt::format("cam{}/data.csv", i));
  if (roots.empty()) roots = files.folders_holding("cam0/sensor.yaml");  // its CSV is what is missing
  if (roots.empty()) {
    std::error_code ignored;
    const bool bag = std::filesystem::exists(path + "/metadata.yaml", ignored);
    return Error{ErrorCode::not_found, fmt::format("{}: no cam0/data.csv in it: not a EuRoC dataset{}", path,
                                                   bag ? fmt::format(" ({})", kAboutRosBags) : "")};
  }
  if (roots.size() > 1)
    return Error{ErrorCode::unsupported,
                 fmt::format("{}: holds {} datasets ({} ...), give one of them", path, roots.size(), roots[0])};
  return roots.front();
}

std::string dataset_name(const std::string& path) {
  std::filesystem::path p = std::filesystem::path(path).lexically_normal();
  if (!p.has_filename()) p = p.parent_path();
  if (p.filename() == "mav0" && p.has_parent_path()) p = p.parent_path();
  return p.extension() == ".zip" ? p.stem().string() : p.filename().string();
}

}  // namespace fbvins
