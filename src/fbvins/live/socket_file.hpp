// SPDX-License-Identifier: Apache-2.0
// A Unix socket that listens at a path: for its owner alone, or for a group as well; removed at the end. The socket of a dead
// server is replaced; that of a living one, or a file that is not a socket, is left alone and is an error.
#pragma once

#include <sys/types.h>

#include <string>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

class SocketFile {
 public:
  /// `group`: a name; this program must be the group's member. Empty: for the owner alone.
  static Result<SocketFile> listen(const std::string& path, const std::string& group = "");
  SocketFile(SocketFile&&) = default;
  SocketFile& operator=(SocketFile&&) = delete;
  ~SocketFile();

  const std::string& path() const { return path_; }
  int fd() const { return socket_.number(); }

 private:
  SocketFile(std::string path, FileDescriptor socket) : path_(std::move(path)), socket_(std::move(socket)) {}

  std::string path_;
  FileDescriptor socket_;
  ino_t inode_ = 0;  ///< of the file, as another program may have replaced it meanwhile
};

}  // namespace fbvins
