// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/kitti_poses.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "fbvins/geometry/pose.hpp"
#include "fbvins/io/csv.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kNumbers = 12;
constexpr std::uint64_t kLargestTimes_bytes = std::uint64_t{1} << 28u;
constexpr double kNoRotation = 0.01;

std::vector<std::filesystem::path> places_of_times(const std::filesystem::path& poses) {
  const std::filesystem::path folder = poses.parent_path(), name = poses.stem();
  return {folder / (name.string() + "_times.txt"), folder / "times.txt", folder / ".." / "sequences" / name / "times.txt"};
}

/// R | p as x y z qx qy qz qw; none where R is no rotation.
std::optional<std::string> as_tum(const std::array<double, kNumbers>& m) {
  Mat3 R;
  R << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  if (!((R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() < kNoRotation) || !(R.determinant() > 0))
    return std::nullopt;
  const Quat q = Quat(R).normalized();
  return fmt::format("{} {} {} {} {} {} {}", m[3], m[7], m[11], q.x(), q.y(), q.z(), q.w());
}

}  // namespace

bool looks_like_kitti(std::string_view text) {
  const std::vector<CsvLine> data = data_lines(text.substr(0, 1u << 16u));
  if (data.empty()) return false;
  std::vector<std::string_view> fields;
  split_at_blanks(data.front().text, fields);
  const auto first = fields.size() == kNumbers ? parse_double(fields.front()) : std::nullopt;
  return first && std::abs(*first) <= 1.001;  // an element of a rotation, no stamp
}

Result<KittiPoses> kitti_with_times(std::string_view text, const std::string& path) {
  KittiPoses out;
  std::error_code ignored;
  for (const std::filesystem::path& place : places_of_times(path))
    if (out.times.empty() && std::filesystem::exists(place, ignored)) out.times = place.lexically_normal().string();
  if (out.times.empty())
    return Error{ErrorCode::unsupported,
                 fmt::format("{}: KITTI's poses, 12 numbers a row without a time: put its times.txt beside it", path)};
  const Result<std::string> beside = read_file(out.times, kLargestTimes_bytes);
  if (!beside) return beside.error();
  const std::vector<CsvLine> poses = data_lines(text), times = data_lines(*beside);
  if (poses.size() != times.size())
    return Error{ErrorCode::malformed,
                 fmt::format("{}: {} poses, and {} times in {}", path, poses.size(), times.size(), out.times)};
  std::vector<std::string_view> fields;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    split_at_blanks(poses[i].text, fields);
    std::array<double, kNumbers> m{};
    const bool numbers = fields.size() == kNumbers && parse_doubles(fields, 0, kNumbers, 1e9, m.data()) == RowVerdict::good;
    const auto pose = numbers ? as_tum(m) : std::nullopt;
    if (!pose)
      return Error{ErrorCode::malformed,
                   fmt::format("{}:{}: not a rotation and a translation in 12 numbers", path, poses[i].number)};
    out.tum += fmt::format("{} {}\n", times[i].text, *pose);
  }
  return out;
}

}  // namespace fbvins
