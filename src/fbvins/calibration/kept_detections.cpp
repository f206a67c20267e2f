// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/kept_detections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "fbvins/calibration/detect_board.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/io/csv.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEnding = ".found";
constexpr std::uint64_t kLargest_bytes = 1u << 26u;

/// FNV-1a of all stamps, cameras and names.
std::uint64_t digest(const std::vector<ListedImage>& images) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const ListedImage& image : images)
    for (const char c : fmt::format("{},{},{}\n", image.t.ns, image.camera, image.name))
      hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return hash;
}

std::string key_of(const Board& board, const std::vector<ListedImage>& images) {
  return fmt::format("found 1; board {} {} {} {} {}; {} images {:016x}", static_cast<int>(board.kind), board.columns, board.rows,
                     board.size_m, board.spacing, images.size(), digest(images));
}

/// Numbers with all digits: what is read is what was found.
std::string text_of(const ImageFinding& found) {
  std::string out = fmt::format("image {} {} {} {} {} {} {}\n", found.size.width, found.size.height, found.tags,
                                found.foreign_tags, found.twice, found.mirrored ? 1 : 0, found.view.corners.size());
  if (!found.problem.empty()) out += fmt::format("problem {}\n", found.problem);
  for (const BoardCorner& corner : found.view.corners)
    out += fmt::format("{} {} {}\n", corner.index, corner.pixel.x(), corner.pixel.y());
  return out;
}

/// The lines of a part, one after the other.
class PartReader {
 public:
  explicit PartReader(std::string_view text) : lines_(lines_of(text)) {}

  bool begins_with(const std::string& key) { return next_ < lines_.size() && lines_[next_++].text == key; }
  bool at_end() const { return next_ == lines_.size(); }

  bool read(ImageFinding& out) {
    double n[7];
    if (!numbers("image", n, 7)) return false;
    out.size = {static_cast<int>(n[0]), static_cast<int>(n[1])};
    out.tags = static_cast<int>(n[2]), out.foreign_tags = static_cast<int>(n[3]), out.twice = static_cast<int>(n[4]);
    out.mirrored = n[5] != 0;
    constexpr std::string_view kProblem = "problem ";
    if (next_ < lines_.size() && lines_[next_].text.starts_with(kProblem))
      out.problem = lines_[next_++].text.substr(kProblem.size());
    for (int i = 0; i < static_cast<int>(n[6]); ++i) {
      double corner[3];
      if (!numbers("", corner, 3)) return false;
      out.view.corners.push_back({static_cast<int>(corner[0]), {corner[1], corner[2]}});
    }
    return true;
  }

 private:
  bool numbers(std::string_view word, double* out, std::size_t count) {
    if (at_end()) return false;
    split_at_blanks(lines_[next_++].text, fields_);
    const std::size_t first = word.empty() ? 0 : 1;
    if (fields_.size() != first + count || (first == 1 && fields_[0] != word)) return false;
    for (std::size_t i = 0; i < count; ++i) {
      const std::optional<double> value = parse_double(fields_[first + i]);
      if (!value || !(std::abs(*value) < 1e8)) return false;
      out[i] = *value;
    }
    return true;
  }

  std::vector<CsvLine> lines_;
  std::size_t next_ = 0;
  std::vector<std::string_view> fields_;
};

}  // namespace

KeptDetections::KeptDetections(std::string folder, const Board& board, const std::vector<ListedImage>& images)
    : folder_(std::move(folder)), key_(key_of(board, images)), images_(images) {}

std::string KeptDetections::file_of(std::size_t part) const { return fmt::format("{}/{:06}{}", folder_, part, kEnding); }

ImageFindings KeptDetections::read() const {
  ImageFindings all(images_.size());
  bool some = false;
  for (std::size_t part = 0; part * kImagesOfPart < images_.size(); ++part) {
    std::vector<ImageFinding> found = read_part(part);
    some = some || !found.empty();
    std::ranges::move(found, all.begin() + static_cast<std::ptrdiff_t>(part * kImagesOfPart));
  }
  if (!some) forget();
  return all;
}

std::vector<ImageFinding> KeptDetections::read_part(std::size_t part) const {
  const Result<std::string> text = read_file(file_of(part), kLargest_bytes);
  if (!text) return {};
  PartReader in(*text);
  if (!in.begins_with(key_)) return {};
  std::vector<ImageFinding> out;
  for (std::size_t i = part * kImagesOfPart; i < std::min(images_.size(), (part + 1) * kImagesOfPart); ++i) {
    out.push_back({{images_[i].t, images_[i].camera, {}}, {}});
    if (!in.read(out.back())) return {};
  }
  return in.at_end() ? out : std::vector<ImageFinding>{};
}

Result<void> KeptDetections::keep(std::size_t part, const ImageFindings& all) const {
  if (Result<void> made = make_folders(folder_); !made) return made;
  std::string text = key_ + "\n";
  for (std::size_t i = part * kImagesOfPart; i < std::min(all.size(), (part + 1) * kImagesOfPart); ++i) text += text_of(*all[i]);
  return write_file_atomically(file_of(part), text);
}

void KeptDetections::forget() const { forget_kept_detections(folder_); }

void forget_kept_detections(const std::string& folder) {
  std::error_code ignored;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if (entry.path().extension() == kEnding || entry.path().extension() == ".part") files.push_back(entry.path());
  for (const fs::path& file : files) fs::remove(file, ignored);
  fs::remove(folder, ignored);  // only where it is empty
}

}  // namespace fbvins
