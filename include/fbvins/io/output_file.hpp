// SPDX-License-Identifier: Apache-2.0
// A text file that appears whole or not at all: written under a temporary name, renamed by close().
// One thread.
//
//   Result<OutputFile> file = OutputFile::create("summary.txt");
//   file->write("ATE 0.007 m\n");
//   if (Result<void> done = file->close(); !done) report(done.error().message);
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "fbvins/core/result.hpp"

namespace fbvins {

class OutputFile {
 public:
  /// The folder must exist.
  static Result<OutputFile> create(const std::string& path);
  OutputFile(OutputFile&&) noexcept;
  OutputFile& operator=(OutputFile&&) noexcept;
  /// Without close() nothing is left behind.
  ~OutputFile();

  void write(std::string_view text);
  /// Reports the first write that failed (disk full), too. Once.
  Result<void> close();

 private:
  struct State;
  explicit OutputFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace fbvins
