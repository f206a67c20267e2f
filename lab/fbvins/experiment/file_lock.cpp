// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/file_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace fbvins {

Result<FileLock> FileLock::take(const std::string& path, Kind kind, Else otherwise) {
  FileLock lock(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (lock.file_ < 0) return Error{ErrorCode::unwritable, fmt::format("{}: {}", path, std::strerror(errno))};
  const int operation = (kind == Kind::alone ? LOCK_EX : LOCK_SH) | (otherwise == Else::refuse ? LOCK_NB : 0);
  while (flock(lock.file_, operation) != 0)
    if (errno == EWOULDBLOCK) return FileLock();
    else if (errno != EINTR) return Error{ErrorCode::unwritable, fmt::format("{}: {}", path, std::strerror(errno))};
  return lock;
}

FileLock::~FileLock() {
  if (file_ >= 0) close(file_);
}

FileLock::FileLock(FileLock&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

FileLock& FileLock::operator=(FileLock&& other) noexcept {
  std::swap(file_, other.file_);
  return *this;
}

}  // namespace fbvins
