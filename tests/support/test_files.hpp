// SPDX-License-Identifier: Apache-2.0
// For tests of the commands: a folder of their own, and what is in its files.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace fbvins::app::test {

class Folder {
 public:
  explicit Folder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() / ("fbvins_" + name + "_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string path() const { return path_.string(); }
  std::string text(const std::string& name) const {
    std::ifstream file(path_ / name, std::ios::binary);
    return (std::ostringstream() << file.rdbuf()).str();
  }
  /// Without comments and headers.
  std::vector<std::string> rows(const std::string& name) const {
    std::vector<std::string> out;
    std::istringstream lines(text(name));
    for (std::string line; std::getline(lines, line);)
      if (!line.empty() && line[0] != '#') out.push_back(line);
    return out;
  }

 private:
  std::filesystem::path path_;
};

/// Commas, as a measure of columns.
inline long columns(const std::string& row) { return 1 + std::count(row.begin(), row.end(), ','); }

}  // namespace fbvins::app::test
