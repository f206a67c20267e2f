// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/output_file.hpp"

#include "fbvins/core/atomic_file.hpp"

namespace fbvins {

struct OutputFile::State {
  AtomicFile file;
};

OutputFile::OutputFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
OutputFile::OutputFile(OutputFile&&) noexcept = default;
OutputFile& OutputFile::operator=(OutputFile&&) noexcept = default;
OutputFile::~OutputFile() = default;

Result<OutputFile> OutputFile::create(const std::string& path) {
  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  return OutputFile(std::make_unique<State>(State{*std::move(file)}));
}

void OutputFile::write(std::string_view text) { state_->file.write(text); }

Result<void> OutputFile::close() {
  const std::unique_ptr<State> state = std::move(state_);
  if (!state) return Error{ErrorCode::invalid_argument, "the output file was closed before"};
  return state->file.commit();
}

}  // namespace fbvins
