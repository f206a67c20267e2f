// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/file_source.hpp"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace fbvins {
namespace {

namespace fs = std::filesystem;

Error too_large(const std::string& name, std::uint64_t max_bytes) {
  return {ErrorCode::unsupported, fmt::format("{}: larger than {} MB", name, max_bytes >> 20u)};
}

class FolderSource : public FileSource {
 public:
  explicit FolderSource(std::string root) : root_(std::move(root)) {}

  bool exists(const std::string& path) const override {
    std::error_code ignored;
    return fs::is_regular_file(describe(path), ignored);
  }
  Result<std::string> read(const std::string& path, std::uint64_t max_bytes) const override {
    return read_file(describe(path), max_bytes);
  }
  std::vector<std::string> folders_holding(const std::string& tail) const override {
    std::vector<std::string> found;
    for (const char* folder : {"", "mav0/"})
      if (exists(folder + tail)) found.emplace_back(folder);
    return found;
  }
  std::string describe(const std::string& path) const override { return root_ + "/" + path; }
  bool packed() const override { return false; }

 private:
  std::string root_;
};

class ZipSource : public FileSource {
 public:
  ZipSource(std::string name, zip_t* archive) : name_(std::move(name)), archive_(archive) {}
  ~ZipSource() override { zip_discard(archive_); }
  ZipSource(const ZipSource&) = delete;
  ZipSource& operator=(const ZipSource&) = delete;

  bool exists(const std::string& path) const override { return zip_name_locate(archive_, path.c_str(), 0) >= 0; }

  Result<std::string> read(const std::string& path, std::uint64_t max_bytes) const override {
    zip_stat_t info;
    zip_stat_init(&info);
    if (zip_stat(archive_, path.c_str(), 0, &info) != 0 || !(info.valid & ZIP_STAT_SIZE))
      return Error{ErrorCode::not_found, fmt::format("{}: not in the archive", describe(path))};
    if (info.size > max_bytes) return too_large(describe(path), max_bytes);
    zip_file_t* file = zip_fopen(archive_, path.c_str(), 0);
    if (file == nullptr) return Error{ErrorCode::unreadable, fmt::format("{}: {}", describe(path), zip_strerror(archive_))};
    std::string bytes(info.size, '\0');
    // The size is only a promise of the directory; the end and the checksum are checked by reading on.
    char beyond = 0;
    const bool complete =
        zip_fread(file, bytes.data(), bytes.size()) == static_cast<zip_int64_t>(bytes.size()) && zip_fread(file, &beyond, 1) == 0;
    zip_fclose(file);
    if (!complete) return Error{ErrorCode::unreadable, fmt::format("{}: damaged in the archive", describe(path))};
    return bytes;
  }

  std::vector<std::string> folders_holding(const std::string& tail) const override {
    std::vector<std::string> found;
    const zip_int64_t count = zip_get_num_entries(archive_, 0);
    for (zip_int64_t i = 0; i < count; ++i) {
      const char* raw = zip_get_name(archive_, static_cast<zip_uint64_t>(i), 0);
      if (raw == nullptr) continue;
      const std::string name = raw;
      if (name.size() < tail.size() || name.compare(name.size() - tail.size(), tail.size(), tail) != 0) continue;
      const std::string folder = name.substr(0, name.size() - tail.size());
      // Archives made on a Mac hold a shadow copy of every file.
      const bool shadow = folder.find("__MACOSX/") != std::string::npos;
      if (!shadow && (folder.empty() || folder.back() == '/')) found.push_back(folder);
    }
    std::sort(found.begin(), found.end());
    return found;
  }
  std::string describe(const std::string& path) const override { return name_ + ":" + path; }
  bool packed() const override { return true; }

 private:
  std::string name_;
  zip_t* archive_;
};

Result<std::unique_ptr<FileSource>> open_zip(const std::string& path) {
  int code = 0;
  zip_t* archive = zip_open(path.c_str(), ZIP_RDONLY, &code);
  if (archive == nullptr) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const std::string why = zip_error_strerror(&error);
    zip_error_fini(&error);
    return Error{ErrorCode::malformed, fmt::format("{}: not a whole zip archive ({})", path, why)};
  }
  return std::unique_ptr<FileSource>(std::make_unique<ZipSource>(path, archive));
}

}  // namespace

Result<std::unique_ptr<FileSource>> open_file_source(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) return Error{ErrorCode::not_found, fmt::format("{}: no such file or folder", path)};
  if (fs::is_directory(status)) return std::unique_ptr<FileSource>(std::make_unique<FolderSource>(path));
  if (!fs::is_regular_file(status)) return Error{ErrorCode::unsupported, fmt::format("{}: neither a file nor a folder", path)};
  std::string magic(13, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  if (magic.starts_with("PK")) return open_zip(path);
  if (magic.starts_with("#ROSBAG V") || magic.starts_with("\x89MCAP"))
    return Error{ErrorCode::unsupported, fmt::format("{}: {}", path, kAboutRosBags)};
  return Error{ErrorCode::unsupported, fmt::format("{}: neither a EuRoC folder nor a zip archive", path)};
}

Result<std::string> read_file(const std::string& path, std::uint64_t max_bytes) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) return Error{ErrorCode::not_found, fmt::format("{}: no such file", path)};
  // A pipe or a device would block for ever.
  if (!fs::is_regular_file(status)) return Error{ErrorCode::unreadable, fmt::format("{}: not a plain file", path)};
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return Error{ErrorCode::unreadable, fmt::format("{}: {}", path, error.message())};
  if (size > max_bytes) return too_large(path, max_bytes);
  std::string bytes(size, '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file || !file.read(bytes.data(), static_cast<std::streamsize>(size)))
    return Error{ErrorCode::unreadable, fmt::format("{}: cannot be read", path)};
  return bytes;
}

}  // namespace fbvins
