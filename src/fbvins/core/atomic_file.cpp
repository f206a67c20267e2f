// SPDX-License-Identifier: Apache-2.0
#include "fbvins/core/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace fbvins {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBuffer_bytes = 16 * 1024;
constexpr std::string_view kEnding = ".part";
constexpr int kMostTries = 1000;

Error unwritable(const std::string& path, int problem) {
  return {ErrorCode::unwritable, fmt::format("{}: cannot be written ({})", path, std::strerror(problem))};
}

std::string folder_of(const std::string& path) {
  const std::string folder = fs::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

bool is_leftover_of(const std::string& name, const std::string& of) {
  if (name.size() <= of.size() + 1 + kEnding.size() || !name.starts_with(of + ".") || !name.ends_with(kEnding)) return false;
  const std::string_view number = std::string_view(name).substr(of.size() + 1, name.size() - of.size() - 1 - kEnding.size());
  return number.find_first_not_of("0123456789-") == std::string_view::npos;
}

/// A file that nobody has locked has lost its writer.
void remove_if_abandoned(const std::string& path) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat state {};
  if (!file || ::fstat(file.number(), &state) != 0 || !S_ISREG(state.st_mode)) return;
  if (::flock(file.number(), LOCK_EX | LOCK_NB) == 0) ::unlink(path.c_str());
}

void remove_leftovers(const std::string& path) {
  const std::string of = fs::path(path).filename().string();
  std::error_code ended;
  for (auto entry = fs::directory_iterator(folder_of(path), ended); !ended && entry != fs::directory_iterator();
       entry.increment(ended))
    if (is_leftover_of(entry->path().filename().string(), of)) remove_if_abandoned(entry->path().string());
}

/// Locked, unless the file system knows no locks. False: another writer took it for a leftover in the moment before.
bool lock(const FileDescriptor& file) {
  if (::flock(file.number(), LOCK_EX | LOCK_NB) != 0) return errno != EWOULDBLOCK;
  struct stat state {};
  return ::fstat(file.number(), &state) != 0 || state.st_nlink > 0;
}

/// Returns errno of what went wrong, or 0.
int put_at(const FileDescriptor& file, std::uint64_t offset, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::pwrite(file.number(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return n < 0 ? errno : ENOSPC;
    offset += static_cast<std::uint64_t>(n);
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return 0;
}

std::string next_temporary(const std::string& path) {
  static std::atomic<unsigned> made{0};
  return fmt::format("{}.{}-{}{}", path, ::getpid(), made++, kEnding);
}

}  // namespace

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return Error{ErrorCode::unwritable, fmt::format("{}: is a folder", path)};
  remove_leftovers(path);
  for (int tries = 0; tries < kMostTries; ++tries) {
    std::string temporary = next_temporary(path);
    FileDescriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
    if (!file && errno != EEXIST && errno != EINTR) return unwritable(path, errno);
    if (file && lock(file)) return AtomicFile(path, std::move(temporary), std::move(file));
  }
  return unwritable(path, EEXIST);
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::exchange(other.temporary_, {})),
      file_(std::move(other.file_)),
      waiting_(std::move(other.waiting_)),
      size_(other.size_),
      failure_(other.failure_) {}

AtomicFile::~AtomicFile() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void AtomicFile::put(std::uint64_t offset, std::string_view bytes) {
  if (failure_ == 0) failure_ = put_at(file_, offset, bytes);
}

void AtomicFile::flush() {
  put(size_ - waiting_.size(), waiting_);
  waiting_.clear();
}

void AtomicFile::write(std::string_view bytes) {
  size_ += bytes.size();
  if (waiting_.empty() && bytes.size() >= kBuffer_bytes) return put(size_ - bytes.size(), bytes);
  waiting_ += bytes;
  if (waiting_.size() >= kBuffer_bytes) flush();
}

void AtomicFile::overwrite(std::uint64_t offset, std::string_view bytes) {
  flush();
  put(offset, bytes);
}

Result<void> AtomicFile::status() const { return failure_ == 0 ? Result<void>() : unwritable(path_, failure_); }

Result<void> AtomicFile::commit() {
  flush();
  // Before the rename: otherwise the name may reach the disk before the bytes, and a power cut leaves an empty file.
  if (failure_ == 0 && ::fsync(file_.number()) != 0) failure_ = errno;
  if (failure_ == 0 && ::rename(temporary_.c_str(), path_.c_str()) != 0) failure_ = errno;
  if (failure_ != 0) return status();
  temporary_.clear();
  const FileDescriptor folder(::open(folder_of(path_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder) (void)::fsync(folder.number());
  return {};
}

Result<void> write_file_atomically(const std::string& path, std::string_view bytes) {
  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  file->write(bytes);
  return file->commit();
}

Result<void> make_folders(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return Error{ErrorCode::unwritable, fmt::format("{}: {}", path, error.message())};
  return {};
}

Result<void> write_files(const std::string& folder, const std::vector<NamedText>& files) {
  if (Result<void> made = make_folders(folder); !made) return made;
  for (const auto& [name, text] : files)
    if (Result<void> done = write_file_atomically(folder + "/" + name, text); !done) return done;
  return {};
}

Result<void> append_to_file(const std::string& path, std::string_view bytes) {
  const FileDescriptor file(::open(path.c_str(), O_WRONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat state {};
  if (!file || ::fstat(file.number(), &state) != 0) return unwritable(path, errno);
  int failure = put_at(file, static_cast<std::uint64_t>(state.st_size), bytes);
  if (failure == 0 && ::fsync(file.number()) != 0) failure = errno;
  return failure == 0 ? Result<void>() : unwritable(path, failure);
}

Result<std::string> set_aside(const std::string& path) {
  for (int number = 1; number < kMostTries; ++number) {
    std::string name = path + ".bad" + (number == 1 ? "" : fmt::to_string(number));
    if (::renameat2(AT_FDCWD, path.c_str(), AT_FDCWD, name.c_str(), RENAME_NOREPLACE) == 0) return name;
    const int problem = errno;
    if (problem == EEXIST) continue;
    // Not every file system can refuse to replace.
    struct stat state {};
    if (problem == EINVAL && ::lstat(name.c_str(), &state) == 0) continue;
    if (problem == EINVAL && ::rename(path.c_str(), name.c_str()) == 0) return name;
    return Error{ErrorCode::unwritable, fmt::format("{}: cannot be set aside ({})", path, std::strerror(problem))};
  }
  return Error{ErrorCode::unwritable, fmt::format("{}: cannot be set aside, there are too many others", path)};
}

}  // namespace fbvins
