// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/euroc_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <utility>

#include "fbvins/io/csv.hpp"
#include "fbvins/io/no_overlap.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestFolderCsv_bytes = std::uint64_t{1} << 30u;

/// The text of a trajectory without what comes from each step of its clock on, and those parts.
std::vector<std::string> parts_of(const std::string& csv) {
  std::vector<Time> stamps;
  std::vector<int> lines;
  for (const CsvLine& line : data_lines(csv))
    if (const auto t = parse_nanoseconds(trim(line.text.substr(0, line.text.find(','))))) {
      stamps.push_back(*t);
      lines.push_back(line.number);
    }
  std::vector<std::string> out;
  std::size_t at = 0;
  int number = 1;
  for (const std::size_t step : clock_steps(stamps)) {
    std::size_t end = at;
    for (; number < lines[step] && end != std::string::npos; ++number) end = csv.find('\n', end) + 1;
    out.push_back(csv.substr(at, end - at));
    at = end;
  }
  out.push_back(csv.substr(at));
  return out;
}

}  // namespace

std::vector<std::string> row_warnings(const RowCounts& c, const std::string& file) {
  std::vector<std::string> out;
  if (c.wraps > 0) out.push_back(wrapped_sentence(file, c.wraps));
  const std::string shared = shared_stamps(c.rows, c.duplicates);
  if (c.bad() > 0)
    out.push_back(
        fmt::format("{}: {} of {} rows left out ({} malformed, {} not finite, {} duplicates, {} out of order), the first: {}",
                    file, c.bad(), c.rows, c.malformed, c.not_finite, c.duplicates, c.backwards, c.first_bad) +
        (shared.empty() ? "" : "; ") + shared);
  return out;
}

Result<EurocRows> read_euroc_rows(const FileSource& files, const std::string& root, const EurocSensors& sensors) {
  std::vector<std::string> folders = sensors.cameras;
  if (!sensors.depth.empty()) folders.push_back(sensors.depth);
  std::vector<ParsedRows<ImageRow>> images;
  for (const std::string& folder : folders) {
    Result<std::string> csv = files.read(root + folder + "data.csv", kLargestFolderCsv_bytes);
    if (!csv) return csv.error();
    images.push_back(parse_image_rows(*csv, files.describe(root + folder + "data.csv")));
  }
  ParsedRows<ImuSample> imu;
  if (sensors.imu) {
    const std::string file = files.describe(root + "imu0/data.csv");
    Result<std::string> csv = files.read(root + "imu0/data.csv", kLargestFolderCsv_bytes);
    if (!csv) return csv.error();
    imu = parse_stamped_lines<ImuSample>(data_lines(*csv), file, ImuRowParser{});
  }
  std::vector<StampStream> streams;
  for (std::size_t i = 0; i < images.size(); ++i) streams.push_back(stream_of(folders[i] + "data.csv", images[i].rows));
  streams.push_back(stream_of("imu0/data.csv", imu.rows));
  std::vector<StampStream*> all;
  for (StampStream& s : streams) all.push_back(&s);
  EurocRows out;
  out.clock = join_clock(all);
  const auto take = [&](auto& parsed, const StampStream& stream, auto& rows) -> Result<void> {
    take_clock(stream, parsed.rows);
    auto ordered = in_order(std::move(parsed));
    if (!ordered) return ordered.error();
    for (std::string& warning : row_warnings(ordered->counts, files.describe(root + stream.name)))
      out.warnings.push_back(std::move(warning));
    rows = *std::move(ordered);
    return {};
  };
  out.cameras.resize(sensors.cameras.size());
  for (std::size_t i = 0; i < images.size(); ++i)
    if (Result<void> taken = take(images[i], streams[i], i < out.cameras.size() ? out.cameras[i] : out.depth); !taken)
      return taken.error();
  if (sensors.imu)
    if (Result<void> taken = take(imu, streams.back(), out.imu); !taken) return taken.error();
  std::ranges::copy(out.clock.said, std::back_inserter(out.warnings));
  return out;
}

Result<TrajectoryFile> parse_truth(const std::string& csv, const std::string& file, const JoinedClock& clock) {
  const std::vector<std::string> parts = clock.begins.empty() ? std::vector{csv} : parts_of(csv);
  Result<TrajectoryFile> out = parse_trajectory(parts.front(), file);
  if (!out || clock.begins.empty()) return out;
  if (parts.size() != clock.added.size()) {
    follow_clock(clock, out->points);
    return out;
  }
  for (std::size_t k = 1; k < parts.size(); ++k) {
    Result<TrajectoryFile> part = parse_trajectory(parts[k], file);
    if (!part) return part;
    for (TrajectoryPoint& point : part->points) {
      point.t = point.t + clock.added[k];
      out->points.push_back(std::move(point));
    }
    out->counts += part->counts;
  }
  return out;
}

void refer_to_imu(std::vector<TrajectoryPoint>& truth, const Pose<B, B>& T_SI) {
  if (T_SI.p.norm() < 1e-9 && T_SI.q.vec().norm() < 1e-9) return;
  for (TrajectoryPoint& point : truth) {
    point.T_WB = point.T_WB * T_SI;
    point.v_WB.reset();  // would need the angular rate
    point.bias.reset();
  }
}

}  // namespace fbvins
