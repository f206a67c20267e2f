// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/socket_file.hpp"

#include <fmt/format.h>
#include <grp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace fbvins {
namespace {

constexpr int kWaiting = 4;

FileDescriptor new_socket() { return FileDescriptor(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)); }

Error failed(const std::string& path, const char* what) {
  return {ErrorCode::unwritable, fmt::format("{}: {}: {}", path, what, std::strerror(errno))};
}

/// Removes the socket file of a dead server.
Result<void> make_way(const sockaddr_un& address, const std::string& path) {
  struct stat file {};
  if (::lstat(path.c_str(), &file) != 0) return {};
  if (!S_ISSOCK(file.st_mode)) return Error{ErrorCode::unwritable, path + ": is there already, and is not a socket"};
  const FileDescriptor probe = new_socket();
  if (::connect(probe.number(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 || errno != ECONNREFUSED)
    return Error{ErrorCode::unwritable, path + ": another program listens there"};
  if (::unlink(path.c_str()) != 0) return failed(path, "the socket of a dead program cannot be removed");
  return {};
}

/// Connecting needs the permission to write.
Result<void> open_to(const std::string& group, const std::string& path) {
  std::array<char, 16384> buffer{};
  struct group entry {};
  struct group* found = nullptr;
  if (getgrnam_r(group.c_str(), &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr)
    return Error{ErrorCode::invalid_argument, fmt::format("{}: there is no group '{}'", path, group)};
  if (::lchown(path.c_str(), static_cast<uid_t>(-1), found->gr_gid) != 0) return failed(path, "cannot be given to the group");
  if (::chmod(path.c_str(), S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP) != 0) return failed(path, "cannot be opened to the group");
  return {};
}

}  // namespace

Result<SocketFile> SocketFile::listen(const std::string& path, const std::string& group) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path))
    return Error{ErrorCode::invalid_argument,
                 fmt::format("'{}': the path of a socket has 1 to {} characters", path, sizeof(address.sun_path) - 1)};
  std::memcpy(address.sun_path, path.data(), path.size());
  if (Result<void> free = make_way(address, path); !free) return free.error();
  SocketFile file(path, new_socket());
  // The mode of the socket becomes the mode of the file: at no moment is it open to others.
  if (!file.socket_ || ::fchmod(file.fd(), S_IRUSR | S_IWUSR) != 0) return failed(path, "no socket can be made");
  if (::bind(file.fd(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    return failed(path, "no socket can be made there");
  struct stat state {};
  if (::lstat(path.c_str(), &state) == 0) file.inode_ = state.st_ino;
  if (!group.empty())
    if (Result<void> open = open_to(group, path); !open) return open.error();
  if (::listen(file.fd(), kWaiting) != 0) return failed(path, "cannot be listened at");
  return file;
}

SocketFile::~SocketFile() {
  struct stat state {};
  if (socket_ && inode_ != 0 && ::lstat(path_.c_str(), &state) == 0 && state.st_ino == inode_) ::unlink(path_.c_str());
}

}  // namespace fbvins
