// SPDX-License-Identifier: Apache-2.0
// A tiny EuRoC recording in memory, to be damaged and then written to a folder or a zip archive.
//
//   Files files = toy_dataset();
//   files["imu0/data.csv"].clear();
//   TemporaryFolder folder;
//   write_folder(files, folder.path() + "/toy/mav0");
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace fbvins::test {

/// Path below mav0 -> bytes.
using Files = std::map<std::string, std::string>;

inline constexpr int kToyFrames = 20;       // 20 Hz
inline constexpr int kToyImuSamples = 221;  // 200 Hz, from 0.1 s before the first image to 1.0 s after it
inline constexpr int kToyWidth = 64, kToyHeight = 48;
inline constexpr std::int64_t kToyStart_ns = 1'600'000'000'000'000'123;

std::int64_t toy_stamp_ns(int frame);
/// "cam0/data/1600000000050000123.png"
std::string toy_image(int camera, int frame);

Files toy_dataset();

struct PngKind {
  int width = kToyWidth, height = kToyHeight;
  bool colour = false;
  bool sixteen_bit = false;
};
/// A grey gradient that differs from `seed` to `seed`.
std::string make_png(int seed, const PngKind& kind);
std::string make_jpeg(int seed);

/// Lets `edit` change the lines of a CSV text (lines[0] is the header), and joins them again with '\n'.
void edit_lines(std::string& text, const std::function<void(std::vector<std::string>&)>& edit);
/// Replaces the first occurrence of `from`; throws std::logic_error where there is none.
void replace(std::string& text, const std::string& from, const std::string& to);

void write_folder(const Files& files, const std::string& folder);
/// `top` is the folder within the archive, for example "mav0/"; it precedes every name.
void write_zip(const Files& files, const std::string& path, const std::string& top);

class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace fbvins::test
