// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/euroc_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "fbvins/core/median.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

constexpr double kLargestImuValue = 1e6;  // rad/s or m/s^2: far above the range of any sensor

/// File names stay below the camera's folder.
bool is_harmless_name(std::string_view name) {
  return !name.empty() && name.front() != '/' && name.find("..") == std::string_view::npos &&
         name.find('\0') == std::string_view::npos;
}

/// The name in the camera's folder `data`, which some writers name as well: data/1.png, mav0/cam0/data/1.png.
std::string_view below_data(std::string_view name) {
  constexpr std::string_view kData = "data/";
  const std::size_t at = name.rfind(kData);
  return at == std::string_view::npos || (at > 0 && name[at - 1] != '/') ? name : name.substr(at + kData.size());
}

RowVerdict parse_stamp(std::string_view field, Time& t, std::string& problem) {
  if (const auto stamp = parse_nanoseconds(field)) {
    t = *stamp;
    return RowVerdict::good;
  }
  problem = fmt::format("'{}' is not a stamp in nanoseconds", field.substr(0, 40));
  return RowVerdict::malformed;
}

std::vector<Time> stamps_of(const std::vector<FrameEntry>& frames) {
  std::vector<Time> stamps;
  for (const FrameEntry& frame : frames) stamps.push_back(frame.t);
  return stamps;
}

/// Of increasing stamps, which there are; of two equally near ones the later.
std::size_t nearest(const std::vector<Time>& stamps, Time t) {
  const auto after = static_cast<std::size_t>(std::ranges::lower_bound(stamps, t) - stamps.begin());
  if (after == stamps.size()) return after - 1;
  return after > 0 && t - stamps[after - 1] < stamps[after] - t ? after - 1 : after;
}

/// Of cameras with a common trigger at most this share of the images has a neighbour of the other camera that is no partner.
constexpr double kMostLonely = 1.0 / 3;

/// Partners of images without a common trigger, by number: for each of `stamps` the nearest of `others` to a quarter of the
/// interval before it, at most half an interval from there, each once; -1: none. Motion before an image is known by its readings,
/// that after it by extrapolation.
std::vector<int> partners_without_trigger(const std::vector<Time>& stamps, const std::vector<Time>& others, Duration interval) {
  std::vector<int> out(stamps.size(), -1);
  std::size_t first_free = 0;
  for (std::size_t k = 0; k < stamps.size() && first_free < others.size(); ++k) {
    const Time wanted = stamps[k] - Duration{interval.ns / 4};
    const std::size_t i = std::max(nearest(others, wanted), first_free);
    if (std::abs((others[i] - wanted).ns) > interval.ns / 2) continue;
    out[k] = static_cast<int>(i);
    first_free = i + 1;
  }
  return out;
}

/// Whether too many of `stamps` have none of `others` within the tolerance, but one within an interval.
bool without_trigger(const std::vector<Time>& stamps, const std::vector<Time>& others, Duration tolerance, Duration interval) {
  if (others.empty()) return false;
  const auto lonely = std::ranges::count_if(stamps, [&](Time t) {
    const std::int64_t distance = std::abs((others[nearest(others, t)] - t).ns);
    return distance > tolerance.ns && distance <= interval.ns;
  });
  return static_cast<double>(lonely) > kMostLonely * static_cast<double>(stamps.size());
}

std::vector<Time> stamps_of(const std::vector<ImageRow>& rows) {
  std::vector<Time> stamps;
  for (const ImageRow& row : rows) stamps.push_back(row.t);
  return stamps;
}

PairedFrames pair_without_trigger(const std::vector<ImageRow>& left, const std::vector<ImageRow>& right, Duration interval) {
  PairedFrames out;
  out.untriggered = true;
  const std::vector<Time> lefts = stamps_of(left);
  const std::vector<int> partners = partners_without_trigger(lefts, stamps_of(right), interval);
  std::vector<bool> used(right.size());
  for (std::size_t l = 0; l < left.size(); ++l) {
    FrameEntry& frame = out.frames.emplace_back(FrameEntry{left[l].t, {left[l].file}});
    if (partners[l] < 0) {
      ++out.left_only;
      continue;
    }
    const auto r = static_cast<std::size_t>(partners[l]);
    used[r] = true;
    frame.file(1) = right[r].file;
    frame.offsets.set(1, right[r].t - left[l].t);
  }
  for (std::size_t r = 0; r < right.size(); ++r) {
    if (used[r]) continue;
    ++out.right_only;
    if (std::abs((lefts[nearest(lefts, right[r].t)] - right[r].t).ns) > interval.ns)
      out.frames.push_back({right[r].t, {"", right[r].file}});
  }
  std::ranges::stable_sort(out.frames, {}, &FrameEntry::t);
  return out;
}

}  // namespace

Result<StampedRows<ImageRow>> read_image_rows(std::string_view csv, const std::string& file) {
  return in_order(parse_image_rows(csv, file));
}

ParsedRows<ImageRow> parse_image_rows(std::string_view csv, const std::string& file) {
  std::vector<std::string_view> fields;
  return parse_stamped_lines<ImageRow>(data_lines(csv), file, [&](std::string_view line, ImageRow& row, std::string& problem) {
    split_at_commas(line, fields);
    if (fields.size() != 2) {
      problem = columns_sentence(line, fields.size(), "2");
      return RowVerdict::malformed;
    }
    if (!is_harmless_name(fields[1])) {
      problem = fmt::format("'{}' is not the name of an image file", fields[1].substr(0, 40));
      return RowVerdict::malformed;
    }
    row.file = below_data(fields[1]);
    return parse_stamp(fields[0], row.t, problem);
  });
}

RowVerdict ImuRowParser::operator()(std::string_view line, ImuSample& sample, std::string& problem) {
  split_at_commas(line, fields_);
  if (fields_.size() != 7) {
    problem = columns_sentence(line, fields_.size(), "7");
    return RowVerdict::malformed;
  }
  if (const RowVerdict stamp = parse_stamp(fields_[0], sample.t, problem); stamp != RowVerdict::good) return stamp;
  double v[6];
  const RowVerdict verdict = parse_doubles(fields_, 1, 6, kLargestImuValue, v);
  if (verdict != RowVerdict::good) problem = "a value is not a usable number";
  sample.gyro_radps = Vec3(v[0], v[1], v[2]);
  sample.accel_mps2 = Vec3(v[3], v[4], v[5]);
  return verdict;
}

PairedFrames pair_frames(const std::vector<ImageRow>& left, const std::vector<ImageRow>& right, Duration tolerance) {
  const std::vector<Time> stamps = stamps_of(left);
  const Duration interval = measure_intervals(stamps).median, half_interval{interval.ns / 2};
  if (half_interval.ns > 0) tolerance.ns = std::min(tolerance.ns, half_interval.ns);
  const auto distance = [&](std::size_t l, std::size_t r) { return std::abs((left[l].t - right[r].t).ns); };
  if (interval.ns > 0 && without_trigger(stamps, stamps_of(right), tolerance, interval))
    return pair_without_trigger(left, right, interval);
  PairedFrames out;
  std::size_t r = 0;
  const auto skip_right = [&](std::size_t next_left) {
    const bool before_free = next_left == 0 || right[r].t > left[next_left - 1].t + half_interval;
    const bool after_free = next_left == left.size() || right[r].t + half_interval < left[next_left].t;
    if (before_free && after_free) out.frames.push_back({right[r].t, {"", right[r].file}});
    ++r, ++out.right_only;
  };
  for (std::size_t l = 0; l < left.size(); ++l) {
    while (r < right.size() && right[r].t < left[l].t && distance(l, r) > tolerance.ns) skip_right(l);
    while (r + 1 < right.size() && distance(l, r + 1) < distance(l, r)) skip_right(l);
    const bool paired = r < right.size() && distance(l, r) <= tolerance.ns;
    out.frames.push_back({left[l].t, {left[l].file, paired ? right[r].file : ""}});
    paired ? ++r : ++out.left_only;
  }
  while (r < right.size()) skip_right(left.size());
  return out;
}

std::string untriggered_sentence(const std::vector<FrameEntry>& frames, int camera, double tolerance_ms) {
  std::vector<double> offsets_ms;
  for (const FrameEntry& frame : frames)
    if (const Duration offset = frame.offsets.of(camera); offset.ns != 0) offsets_ms.push_back(1e3 * offset.seconds());
  return fmt::format(
      "cameras 0 and {} have no common trigger: by stamps and time offsets their images are more than {} ms apart, {:.1f} ms in "
      "the median, and count as taken then; of images that were taken at once, and only stamped apart, --pair-tolerance says so",
      camera, tolerance_ms, median(offsets_ms));
}

int add_depth(std::vector<FrameEntry>& frames, const std::vector<ImageRow>& images, Duration tolerance) {
  const std::vector<Time> stamps = stamps_of(frames);
  int unpaired = 0;
  for (const ImageRow& image : images) {
    FrameEntry& frame = frames[nearest(stamps, image.t)];
    if (Duration{std::abs((image.t - frame.t).ns)} <= tolerance && frame.depth_file.empty()) frame.depth_file = image.file;
    else ++unpaired;
  }
  return unpaired;
}

int add_camera(std::vector<FrameEntry>& frames, const std::vector<ImageRow>& images, int camera, Duration tolerance) {
  const std::vector<Time> stamps = stamps_of(frames);
  const Duration interval = measure_intervals(stamps).median, half_interval{interval.ns / 2};
  if (half_interval.ns > 0) tolerance.ns = std::min(tolerance.ns, half_interval.ns);
  if (interval.ns > 0 && without_trigger(stamps, stamps_of(images), tolerance, interval)) {
    const std::vector<int> partners = partners_without_trigger(stamps, stamps_of(images), interval);
    for (std::size_t k = 0; k < frames.size(); ++k) {
      if (partners[k] < 0) continue;
      const ImageRow& image = images[static_cast<std::size_t>(partners[k])];
      frames[k].file(camera) = image.file;
      frames[k].offsets.set(camera, image.t - frames[k].t);
    }
    return static_cast<int>(images.size()) - static_cast<int>(std::ranges::count_if(partners, [](int i) { return i >= 0; }));
  }
  std::vector<FrameEntry> alone;
  int unpaired = 0;
  for (const ImageRow& image : images) {
    if (!stamps.empty()) {
      FrameEntry& frame = frames[nearest(stamps, image.t)];
      const Duration distance{std::abs((image.t - frame.t).ns)};
      if (distance <= tolerance && frame.file(camera).empty()) {
        frame.file(camera) = image.file;
        continue;
      }
      ++unpaired;
      if (distance <= half_interval) continue;
    }
    alone.push_back({image.t});
    alone.back().file(camera) = image.file;
  }
  frames.insert(frames.end(), std::make_move_iterator(alone.begin()), std::make_move_iterator(alone.end()));
  std::ranges::stable_sort(frames, {}, &FrameEntry::t);
  return unpaired;
}

std::vector<FrameEntry> join_images(std::vector<std::vector<ImageRow>> cameras, const std::vector<ImageRow>& depth,
                                    const ExposureOffsets& own, double tolerance_ms, DatasetInfo& info) {
  for (std::size_t i = 0; i < cameras.size(); ++i)
    for (ImageRow& image : cameras[i]) image.t = image.t + own.of(static_cast<int>(i));
  const Duration tolerance = Duration::from_seconds(1e-3 * tolerance_ms);
  const auto warn = [&](std::string sentence) { info.warnings.push_back(std::move(sentence)); };
  const bool has_right = cameras.size() > 1;
  PairedFrames paired = pair_frames(cameras[0], has_right ? cameras[1] : std::vector<ImageRow>{}, tolerance);
  info.camera(0).unpaired = has_right ? paired.left_only : 0;
  info.camera(1).unpaired = paired.right_only;
  if (paired.untriggered) warn(untriggered_sentence(paired.frames, 1, tolerance_ms));
  else if (info.camera(0).unpaired + info.camera(1).unpaired > 0)
    warn(fmt::format("{} left and {} right images have no partner within {} ms", info.camera(0).unpaired, info.camera(1).unpaired,
                     tolerance_ms));
  std::vector<FrameEntry> frames = std::move(paired.frames);
  if (!frames.empty()) info.depth.unpaired = add_depth(frames, depth, tolerance);
  if (info.depth.unpaired > 0) warn(fmt::format("{} depth images have no image within {} ms", info.depth.unpaired, tolerance_ms));
  for (int i = 2; i < static_cast<int>(cameras.size()); ++i)
    info.camera(i).unpaired = add_camera(frames, cameras[static_cast<std::size_t>(i)], i, tolerance);
  if (const int unpaired = info.further().unpaired; unpaired > 0)
    warn(fmt::format("{} images of further cameras have no partner within {} ms", unpaired, tolerance_ms));
  for (FrameEntry& frame : frames) frame.offsets -= own;
  return frames;
}

Intervals measure_intervals(const std::vector<Time>& increasing) {
  Intervals out;
  std::vector<Duration> steps;
  for (std::size_t i = 1; i < increasing.size(); ++i) {
    steps.push_back(increasing[i] - increasing[i - 1]);
    if (steps.back() > out.longest) {
      out.longest = steps.back();
      out.longest_start = increasing[i - 1];
    }
  }
  if (steps.empty()) return out;
  out.median = median(steps);
  out.rate_hz = 1.0 / out.median.seconds();
  return out;
}

}  // namespace fbvins
