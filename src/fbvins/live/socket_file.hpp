// SPDX-License-Identifier: Apache-2.0
// A Unix socket that listens at a path: for its owner alone, removed at the end. What a dead server left there is replaced;
// what a living one serves, or what is no socket, is left alone and an error.
#pragma once

#include <sys/types.h>

#include <string>

#include "fbvins/core/file_descriptor.hpp"
#include "fbvins/core/result.hpp"

namespace fbvins {

class SocketFile {
 public:
  static Result<SocketFile> listen(const std::string& path);
  SocketFile(SocketFile&&) = default;
  SocketFile& operator=(SocketFile&&) = delete;
  ~SocketFile();

  const std::string& path() const { return path_; }
  int fd() const { return socket_.number(); }

 private:
  SocketFile(std::string path, FileDescriptor socket) : path_(std::move(path)), socket_(std::move(socket)) {}

  std::string path_;
  FileDescriptor socket_;
  ino_t inode_ = 0;  ///< of the file: somebody may have put another one there since
};

}  // namespace fbvins
