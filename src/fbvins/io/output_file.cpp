// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/output_file.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

namespace fbvins {

namespace fs = std::filesystem;

struct OutputFile::State {
  std::string path, temporary;
  std::ofstream stream;

  ~State() {
    if (!stream.is_open()) return;
    stream.close();
    std::error_code ignored;
    fs::remove(temporary, ignored);
  }
};

OutputFile::OutputFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
OutputFile::OutputFile(OutputFile&&) noexcept = default;
OutputFile& OutputFile::operator=(OutputFile&&) noexcept = default;
OutputFile::~OutputFile() = default;

Result<OutputFile> OutputFile::create(const std::string& path) {
  auto state = std::make_unique<State>();
  state->path = path;
  state->temporary = path + ".part";
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return Error{ErrorCode::unwritable, fmt::format("{}: is a folder", path)};
  state->stream.open(state->temporary, std::ios::binary | std::ios::trunc);
  if (!state->stream) return Error{ErrorCode::unwritable, fmt::format("{}: cannot be written", path)};
  return OutputFile(std::move(state));
}

void OutputFile::write(std::string_view text) { state_->stream.write(text.data(), static_cast<std::streamsize>(text.size())); }

Result<void> OutputFile::close() {
  const std::unique_ptr<State> state = std::move(state_);
  if (!state) return Error{ErrorCode::invalid_argument, "the output file was closed before"};
  state->stream.flush();
  if (!state->stream) return Error{ErrorCode::unwritable, fmt::format("{}: writing failed (disk full?)", state->path)};
  state->stream.close();
  std::error_code error;
  fs::rename(state->temporary, state->path, error);
  if (!error) return {};
  std::error_code ignored;
  fs::remove(state->temporary, ignored);
  return Error{ErrorCode::unwritable, fmt::format("{}: {}", state->path, error.message())};
}

}  // namespace fbvins
