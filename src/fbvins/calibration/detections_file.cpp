// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/detections_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "fbvins/io/csv.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/numbers.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargest_bytes = 1ull << 30u;
constexpr int kLargestImage_px = 20000;
constexpr const char* kHeader = "timestamp_ns,camera,corner,u_px,v_px";

/// A whole number from 0 to `largest`.
std::optional<int> parse_index(std::string_view text, int largest) {
  const std::optional<double> value = parse_double(text);
  if (!value || !(*value >= 0 && *value <= largest) || *value != std::floor(*value)) return std::nullopt;
  return static_cast<int>(*value);
}

struct Row {
  Time t;
  int camera = 0;
  BoardCorner corner;
};

/// The row, or what is wrong with it.
std::string parse_row(std::string_view line, std::vector<std::string_view>& fields, Row& row) {
  split_at_commas(line, fields);
  if (fields.size() != 5) return fmt::format("has {} fields, not the five of {}", fields.size(), kHeader);
  const std::optional<Time> t = parse_nanoseconds(fields[0]);
  if (!t) return fmt::format("timestamp_ns: '{}' is no stamp in nanoseconds", quoted(fields[0]));
  const std::optional<int> camera = parse_index(fields[1], kMostCameras - 1);
  if (!camera) return fmt::format("camera: '{}' is not a whole number from 0 to {}", quoted(fields[1]), kMostCameras - 1);
  const std::optional<int> corner = parse_index(fields[2], 1'000'000);
  if (!corner) return fmt::format("corner: '{}' is not the number of a corner", quoted(fields[2]));
  for (const int k : {0, 1}) {
    const std::optional<double> value = parse_double(fields[3 + k]);
    if (!value || !(std::abs(*value) <= kLargestImage_px))
      return fmt::format("{}: '{}' is no position in an image", k == 0 ? "u_px" : "v_px", quoted(fields[3 + k]));
    row.corner.pixel[k] = *value;
  }
  row.t = *t;
  row.camera = *camera;
  row.corner.index = *corner;
  return "";
}

/// "# camera 0: 752 x 480"; other comments say nothing.
void read_comment(std::string_view line, std::map<int, ImageSize>& sizes) {
  int camera = 0;
  ImageSize size;
  if (std::sscanf(std::string(line).c_str(), "# camera %d: %d x %d", &camera, &size.width, &size.height) == 3 && camera >= 0 &&
      camera < kMostCameras && size.width > 0 && size.height > 0 && std::max(size.width, size.height) <= kLargestImage_px)
    sizes[camera] = size;
}

/// Corners in order; an error where one is there twice.
Result<void> sort_corners(BoardView& view, const std::string& file) {
  std::ranges::stable_sort(view.corners, {}, &BoardCorner::index);
  const auto twice = std::ranges::adjacent_find(view.corners, {}, &BoardCorner::index);
  if (twice == view.corners.end()) return {};
  return Error{ErrorCode::malformed,
               fmt::format("{}: corner {} is there twice in the image of camera {} at {} ns: only one board may be in view", file,
                           twice->index, view.camera, view.t.ns)};
}

}  // namespace

int Detections::camera_count() const {
  int count = sizes.empty() ? 0 : sizes.rbegin()->first + 1;  // one may never see the board
  for (const BoardView& view : views) count = std::max(count, view.camera + 1);
  return count;
}

Result<Detections> parse_detections(std::string_view text, const std::string& file) {
  Detections out;
  for (const CsvLine& line : lines_of(text)) {
    if (line.text.front() != '#') break;
    read_comment(line.text, out.sizes);
  }
  std::map<std::pair<std::int64_t, int>, BoardView> views;
  std::vector<std::string_view> fields;
  for (const CsvLine& line : data_lines(text)) {
    Row row;
    const std::string problem = parse_row(line.text, fields, row);
    if (!problem.empty()) return Error{ErrorCode::malformed, fmt::format("{}:{}: {}", file, line.number, problem)};
    BoardView& view = views[{row.t.ns, row.camera}];
    view.t = row.t;
    view.camera = row.camera;
    view.corners.push_back(row.corner);
  }
  if (views.empty()) return Error{ErrorCode::malformed, fmt::format("{}: holds no corners", file)};
  for (auto& [key, view] : views) {
    if (Result<void> sorted = sort_corners(view, file); !sorted) return sorted.error();
    out.views.push_back(std::move(view));
  }
  return out;
}

Result<Detections> read_detections(const std::string& path) {
  Result<std::string> text = read_file(path, kLargest_bytes);
  if (!text) return text.error();
  return parse_detections(*text, path);
}

std::string detections_to_csv(const Detections& detections) {
  std::string out;
  for (const auto& [camera, size] : detections.sizes)
    out += fmt::format("# camera {}: {} x {}\n", camera, size.width, size.height);
  out += fmt::format("{}\n", kHeader);
  for (const BoardView& view : detections.views)
    for (const BoardCorner& corner : view.corners)
      fmt::format_to(std::back_inserter(out), "{},{},{},{:.4f},{:.4f}\n", view.t.ns, view.camera, corner.index, corner.pixel.x(),
                     corner.pixel.y());
  return out;
}

}  // namespace fbvins
