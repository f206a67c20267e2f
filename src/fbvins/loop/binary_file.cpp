// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/binary_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace fbvins {
namespace {

/// Closes what was opened.
struct OpenFile {
  int fd = -1;
  ~OpenFile() {
    if (fd >= 0) ::close(fd);
  }
};

Error system_error(ErrorCode code, const std::string& path) { return {code, fmt::format("{}: {}", path, std::strerror(errno))}; }

}  // namespace

Result<std::shared_ptr<const MappedFile>> MappedFile::open(const std::string& path) {
  const OpenFile file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};  // no FIFO holds it up
  if (file.fd < 0) return system_error(errno == ENOENT ? ErrorCode::not_found : ErrorCode::unreadable, path);
  struct stat status {};
  if (::fstat(file.fd, &status) != 0) return system_error(ErrorCode::unreadable, path);
  if (!S_ISREG(status.st_mode)) return Error{ErrorCode::unreadable, fmt::format("{}: not a file", path)};
  std::shared_ptr<MappedFile> mapped(new MappedFile);
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size > 0) {
    void* at = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.fd, 0);
    if (at == MAP_FAILED) return system_error(ErrorCode::unreadable, path);
    mapped->bytes_ = {static_cast<const std::byte*>(at), size};
  }
  return std::shared_ptr<const MappedFile>(std::move(mapped));
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

std::uint64_t checksum64(std::span<const std::byte> bytes) {
  constexpr std::uint64_t kPrime = 0x9E3779B97F4A7C15ULL;
  std::uint64_t lane[4] = {1, 2, 3, 4};
  std::size_t i = 0;
  for (; i + 32 <= bytes.size(); i += 32) {
    std::uint64_t word[4];
    std::memcpy(word, bytes.data() + i, 32);
    for (int l = 0; l < 4; ++l) {
      lane[l] = (lane[l] ^ word[l]) * kPrime;
      lane[l] ^= lane[l] >> 29;
    }
  }
  std::uint64_t sum = bytes.size();
  for (; i < bytes.size(); ++i) sum = (sum ^ static_cast<std::uint64_t>(bytes[i])) * kPrime;
  for (const std::uint64_t l : lane) {
    sum = (sum ^ l) * kPrime;
    sum ^= sum >> 32;
  }
  return sum;
}

}  // namespace fbvins
