// SPDX-License-Identifier: Apache-2.0
// Private: the one way in which files are written that must be whole. The bytes go to a new file beside the old one; commit()
// brings them to the disk and gives them the name. A kill or a power cut at any moment leaves the old file or the new one.
// One thread at a time; several writers of one file, in one process or many, do not disturb each other: the last commit() wins.
//
//   Result<AtomicFile> file = AtomicFile::create("map.fbm");
//   file->write(bytes);
//   if (Result<void> done = file->commit(); !done) report(done.error().message);
//
// The file in work is called NAME.PROCESS-NUMBER.part and is locked: one without a lock is a dead writer's, and the next writer
// of the same file removes it. Links are not followed, neither at that name nor at the final one.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

class AtomicFile {
 public:
  /// The folder must exist.
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&&) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  /// Without commit() nothing is left behind.
  ~AtomicFile();

  /// Appends; the first failure is reported by commit().
  void write(std::string_view bytes);
  /// Replaces bytes that were written before.
  void overwrite(std::uint64_t offset, std::string_view bytes);
  std::uint64_t size() const { return size_; }
  const std::string& path() const { return path_; }
  /// The first failure so far; commit() reports it, too.
  Result<void> status() const;
  /// Once.
  Result<void> commit();

 private:
  AtomicFile(std::string path, std::string temporary, FileDescriptor file)
      : path_(std::move(path)), temporary_(std::move(temporary)), file_(std::move(file)) {}
  void flush();
  void put(std::uint64_t offset, std::string_view bytes);

  std::string path_, temporary_;  ///< temporary_ empty: renamed, or moved from
  FileDescriptor file_;
  std::string waiting_;
  std::uint64_t size_ = 0;
  int failure_ = 0;  ///< errno of the first
};

/// All of a file at once.
Result<void> write_file_atomically(const std::string& path, std::string_view bytes);
/// Makes a folder, and those above it, where they are not there yet.
Result<void> make_folders(const std::string& path);
/// Name and content of a file.
struct NamedText {
  std::string name, text;
};
/// Files of one folder, which is made where it is not there yet.
Result<void> write_files(const std::string& folder, const std::vector<NamedText>& files);
/// To the end of a file that exists, and to the disk. Not atomic: a kill leaves a part of the bytes, which the reader must know.
Result<void> append_to_file(const std::string& path, std::string_view bytes);
/// A function that writes a file, as tests replace it.
using WriteFile = std::function<Result<void>(const std::string& path, std::string_view bytes)>;

/// Renames a file that cannot be used to FILE.bad, FILE.bad2 ..., so that a new one can take its place and nothing is lost.
/// Returns the new name.
Result<std::string> set_aside(const std::string& path);

}  // namespace fbvins
