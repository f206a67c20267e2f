// SPDX-License-Identifier: Apache-2.0
// Which kind of bag it is.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "fbvins/bags/bag_reader.hpp"
#include "fbvins/bags/bag_series.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kLargestMetadata_bytes = 16u << 20u;
constexpr const char* kMetadata = "metadata.yaml";

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

Result<std::unique_ptr<BagReader>> open_file(const std::string& path) {
  const auto bytes = open_bytes(path);
  if (!bytes) return bytes.error();
  return is_ros1_bag(path) ? read_ros1_bag(*bytes, path) : read_mcap_bag(*bytes, path);
}

/// A folder of rosbag2, by its metadata; where that is not there or not whole (the recorder was killed), by its files.
Result<std::unique_ptr<BagReader>> open_folder(const fs::path& folder) {
  std::vector<std::string> files;
  bool packed = false;
  if (is_file(folder / kMetadata)) {
    const auto text = read_file((folder / kMetadata).string(), kLargestMetadata_bytes);
    if (!text) return text.error();
    YamlReader yaml((folder / kMetadata).string(), *text);
    const YAML::Node about = yaml.get(yaml.root(), "rosbag2_bagfile_information");
    for (const std::string& file : yaml.texts(about, "relative_file_paths"))
      files.push_back((folder / fs::path(file).filename()).string());
    const std::string mode = yaml.text(about, "compression_mode"), format = yaml.text(about, "compression_format");
    if (!yaml.ok()) return yaml.error();
    packed = mode == "MESSAGE" || mode == "message";
    if ((mode == "FILE" || mode == "file") || (packed && format != "zstd"))
      return Error{ErrorCode::unsupported,
                   fmt::format("{}: a bag whose files are packed as a whole ({}) cannot be read: unpack them first",
                               folder.string(), format)};
  }
  std::error_code ignored;
  if (files.empty()) {
    for (const auto& entry : fs::directory_iterator(folder, ignored))
      if (entry.path().extension() == ".db3" || entry.path().extension() == ".mcap") files.push_back(entry.path().string());
    std::sort(files.begin(), files.end());
  }
  if (files.empty()) return Error{ErrorCode::not_found, fmt::format("{}: holds no file of a ROS 2 bag", folder.string())};
  if (!files.front().ends_with(".mcap")) return open_sqlite_bag(files, packed);
  std::vector<std::unique_ptr<BagReader>> parts;
  for (const std::string& file : files) {
    auto part = open_file(file);
    if (!part) return part.error();
    parts.push_back(*std::move(part));
  }
  return join_bags(std::move(parts));
}

}  // namespace

bool is_ros1_bag(const std::string& path) {
  if (path.ends_with(".bag") || path.ends_with(".bag.active")) return true;
  const auto bytes = is_file(path) ? open_bytes(path) : Error{ErrorCode::not_found, path};
  return bytes && (*bytes)->read(0, 7) == "#ROSBAG";
}

std::string plain_type(std::string type) {
  if (const std::size_t at = type.find("/msg/"); at != std::string::npos) type.erase(at, 4);
  return type;
}

Result<std::unique_ptr<BagReader>> open_bag(const std::string& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return open_folder(path);
  if (path.ends_with(".db3")) return open_sqlite_bag({path}, false);
  return open_file(path);
}

}  // namespace fbvins
