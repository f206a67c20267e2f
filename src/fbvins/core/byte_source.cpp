// SPDX-License-Identifier: Apache-2.0
#include "fbvins/core/byte_source.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "fbvins/core/file_descriptor.hpp"

namespace fbvins {
namespace {

/// How many of `count` bytes from `offset` there are.
std::size_t available(std::uint64_t size, std::uint64_t offset, std::uint64_t count) {
  return offset >= size ? 0 : static_cast<std::size_t>(std::min(count, size - offset));
}

class FileBytes : public ByteSource {
 public:
  FileBytes(FileDescriptor file, std::uint64_t size) : file_(std::move(file)), size_(size) {}

  std::uint64_t size() const override { return size_; }
  void fill(std::string& out, std::uint64_t offset, std::uint64_t count) const override {
    out.resize(available(size_, offset, count));
    std::size_t done = 0;
    while (done < out.size()) {
      const ssize_t now = ::pread(file_.number(), out.data() + done, out.size() - done, static_cast<off_t>(offset + done));
      if (now < 0 && errno == EINTR) continue;
      if (now <= 0) break;
      done += static_cast<std::size_t>(now);
    }
    out.resize(done);
  }

 private:
  FileDescriptor file_;
  std::uint64_t size_;
};

class MemoryBytes : public ByteSource {
 public:
  explicit MemoryBytes(std::string bytes) : bytes_(std::move(bytes)) {}
  std::uint64_t size() const override { return bytes_.size(); }
  void fill(std::string& out, std::uint64_t offset, std::uint64_t count) const override {
    const std::size_t there = available(bytes_.size(), offset, count);
    if (there == 0) out.clear();
    else out.assign(bytes_, offset, there);
  }

 private:
  std::string bytes_;
};

}  // namespace

Result<std::shared_ptr<ByteSource>> open_bytes(const std::string& path) {
  FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));  // no FIFO holds it up
  if (!file)
    return Error{errno == ENOENT ? ErrorCode::not_found : ErrorCode::unreadable,
                 fmt::format("{}: {}", path, std::strerror(errno))};
  struct stat status {};
  if (::fstat(file.number(), &status) != 0 || !S_ISREG(status.st_mode))
    return Error{ErrorCode::unreadable, fmt::format("{}: is not a plain file", path)};
  const auto size = static_cast<std::uint64_t>(status.st_size);
  return std::shared_ptr<ByteSource>(std::make_shared<FileBytes>(std::move(file), size));
}

std::shared_ptr<ByteSource> bytes_in_memory(std::string bytes) { return std::make_shared<MemoryBytes>(std::move(bytes)); }

}  // namespace fbvins
