// SPDX-License-Identifier: Apache-2.0
#include "fbvins/experiment/file_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <cerrno>
#include <cstring>

namespace fbvins {

Result<FileLock> FileLock::take(const std::string& path, Kind kind, Else otherwise) {
  FileLock lock;
  lock.file_ = FileDescriptor(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (!lock.file_) return Error{ErrorCode::unwritable, fmt::format("{}: {}", path, std::strerror(errno))};
  const int operation = (kind == Kind::alone ? LOCK_EX : LOCK_SH) | (otherwise == Else::refuse ? LOCK_NB : 0);
  while (flock(lock.file_.number(), operation) != 0)
    if (errno == EWOULDBLOCK) return FileLock();
    else if (errno != EINTR) return Error{ErrorCode::unwritable, fmt::format("{}: {}", path, std::strerror(errno))};
  return lock;
}

}  // namespace fbvins
