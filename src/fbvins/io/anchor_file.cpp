// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/anchor_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fbvins/io/csv.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargest_bytes = 1u << 30u;
constexpr double kLargest_m = 1e6;

Error malformed(const std::string& why) { return {ErrorCode::malformed, why}; }

/// Three numbers from fields[first] on; an empty field is NaN.
Result<Vec3> three(const std::vector<std::string_view>& fields, std::size_t first) {
  Vec3 out;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string_view field = fields[first + k];
    const auto number = field.empty() ? std::optional(std::nan("")) : parse_double(field);
    if (!number) return malformed(fmt::format("'{}' is not a number", field.substr(0, 40)));
    if (std::abs(*number) > kLargest_m) return malformed(fmt::format("{} m is too far to be in a building", *number));
    out[static_cast<Eigen::Index>(k)] = *number;
  }
  return out;
}

Result<Anchor> parse_row(std::string_view line, std::vector<std::string_view>& fields) {
  split_at_commas(line, fields);
  if (fields.size() != 7 && fields.size() != 10)
    return malformed(
        fmt::format("{} columns where timestamp_ns,x,y,z,sx,sy,sz or three more, px,py,pz, are expected", fields.size()));
  const auto t = parse_nanoseconds(fields[0]);
  if (!t) return malformed(fmt::format("'{}' is not a stamp in nanoseconds", fields[0].substr(0, 40)));
  const Result<Vec3> p_A = three(fields, 1), sigma = three(fields, 4);
  const Result<Vec3> p_B = fields.size() == 10 ? three(fields, 7) : Vec3(Vec3::Zero());
  for (const Result<Vec3>* part : {&p_A, &sigma, &p_B})
    if (!*part) return part->error();
  if (std::isnan(p_A->z())) return malformed("z is missing");
  if (std::isnan(p_A->x()) != std::isnan(p_A->y())) return malformed("one of x and y is missing: both are given, or none");
  const bool height = std::isnan(p_A->x());
  for (int k = height ? 2 : 0; k < 3; ++k)
    if (!((*sigma)[k] > 0)) return malformed(fmt::format("the standard deviation s{} is not above 0", "xyz"[k]));
  if (!p_B->allFinite()) return malformed("one of px, py and pz is missing");
  if (height) return Anchor(HeightAnchor{*t, p_A->z(), sigma->z(), *p_B});
  return Anchor(PositionAnchor{*t, *p_A, sigma->cwiseAbs2().asDiagonal(), *p_B});
}

}  // namespace

Result<std::vector<Anchor>> parse_anchors(std::string_view text, const std::string& file) {
  std::vector<Anchor> out;
  std::vector<std::string_view> fields;
  for (const CsvLine& line : data_lines(text)) {
    Result<Anchor> anchor = parse_row(line.text, fields);
    if (!anchor) return malformed(fmt::format("{}:{}: {}", file, line.number, anchor.error().message));
    out.push_back(*std::move(anchor));
  }
  if (out.empty()) return malformed(fmt::format("{}: no positions are in it", file));
  std::stable_sort(out.begin(), out.end(), [](const Anchor& a, const Anchor& b) { return stamp_of(a) < stamp_of(b); });
  return out;
}

Result<std::vector<Anchor>> read_anchors(const std::string& path) {
  const Result<std::string> text = read_file(path, kLargest_bytes);
  if (!text) return text.error();
  return parse_anchors(*text, path);
}

}  // namespace fbvins
