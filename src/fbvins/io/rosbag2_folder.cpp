// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/rosbag2_folder.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "fbvins/core/atomic_file.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string metadata(const std::string& file, const RecoveredMcap& written) {
  const std::int64_t duration_ns = (written.last - written.first).ns;
  std::string topics;
  for (const RecoveredMcap::Topic& topic : written.topics)
    if (topic.messages > 0)
      topics += fmt::format(
          "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n"
          "        offered_qos_profiles: \"\"\n      message_count: {}\n",
          quoted(topic.name), topic.type, topic.messages);
  return fmt::format(
      "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n"
      "  duration:\n    nanoseconds: {0}\n  starting_time:\n    nanoseconds_since_epoch: {1}\n  message_count: {2}\n"
      "  topics_with_message_count:\n{3}"
      "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {4}\n  files:\n"
      "    - path: {4}\n      starting_time:\n        nanoseconds_since_epoch: {1}\n      duration:\n        nanoseconds: {0}\n"
      "      message_count: {2}\n",
      duration_ns, written.first.ns, written.messages, topics, quoted(file));
}

}  // namespace

Result<RecoveredMcap> write_rosbag2(const std::string& in, const std::string& out, const McapPart& part) {
  const fs::path folder = fs::path(out).has_filename() ? fs::path(out) : fs::path(out).parent_path();
  std::error_code failed;
  if (!fs::create_directory(folder, failed))
    return Error{ErrorCode::unwritable,
                 fmt::format("{}: {}", out, failed ? "the folder cannot be made: " + failed.message() : "exists already")};
  const std::string file = folder.filename().string() + "_0.mcap";
  McapPart bag = part;
  bag.bag = true;
  auto written = recover_mcap(in, (folder / file).string(), bag);
  if (written)
    if (Result<void> done = write_file_atomically((folder / "metadata.yaml").string(), metadata(file, *written)); !done)
      written = done.error();
  if (!written) fs::remove_all(folder, failed);
  return written;
}

}  // namespace fbvins
