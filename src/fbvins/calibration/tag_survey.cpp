// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/tag_survey.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "fbvins/calibration/target_file.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestSurvey_bytes = 1u << 20u;
constexpr double kSmallest_m = 0.01, kLargest_m = 3, kUnit = 1e-3;

Quat orientation_of(YamlReader& yaml, const YAML::Node& tag) {
  const bool faces = yaml.has(tag, "facing_deg"), turned = yaml.has(tag, "orientation_wxyz");
  if (faces == turned) {
    yaml.complain(tag, "a tag has either facing_deg, upright on a wall, or orientation_wxyz");
    return Quat::Identity();
  }
  if (faces) return upright_facing(yaml.number(tag, "facing_deg") * kDegree);
  const std::vector<double> q = yaml.numbers(tag, "orientation_wxyz", 4);
  const Quat out(q[0], q[1], q[2], q[3]);
  if (yaml.ok() && !(std::abs(out.norm() - 1) < kUnit))
    yaml.complain(tag, "orientation_wxyz", fmt::format("its length is {:g}, not 1", out.norm()));
  return out.normalized();
}

void read_tag(YamlReader& yaml, const YAML::Node& tag, TagSurvey& survey) {
  if (!tag.IsMap())
    return yaml.complain(tag, "a tag is a list of fields, such as {id: 3, position_m: [4, 1, 1.5], facing_deg: 180}");
  yaml.only(tag, {"id", "position_m", "facing_deg", "orientation_wxyz"});
  const double id = yaml.number(tag, "id");
  if (yaml.ok() && !(id >= 0 && id < kTagsOfFamily && id == std::floor(id)))
    yaml.complain(tag, "id", fmt::format("{:g} is not a whole number from 0 to {}", id, kTagsOfFamily - 1));
  Pose<A, Tag> T_AT = unknown_place();
  if (tag.size() > 1) {  // more than its number
    const std::vector<double> p = yaml.numbers(tag, "position_m", 3);
    T_AT = {orientation_of(yaml, tag), Vec3(p[0], p[1], p[2])};
  }
  if (!yaml.ok()) return;
  if (!survey.T_AT.emplace(static_cast<int>(id), T_AT).second)
    yaml.complain(tag, "id", fmt::format("tag {:g} is there twice", id));
}

}  // namespace

Quat upright_facing(double facing_rad) {
  const Vec3 face(std::cos(facing_rad), std::sin(facing_rad), 0);
  Mat3 R;
  R << Vec3::UnitZ().cross(face), Vec3::UnitZ(), face;
  return Quat(R).normalized();
}

Result<TagSurvey> parse_tags(const std::string& text, const std::string& file) {
  YamlReader yaml(file, text);
  yaml.only(yaml.root(), {"family", "size_m", "tags"});
  const std::string family = yaml.word(yaml.root(), "family");
  if (yaml.ok() && family != "tag36h11")
    yaml.complain(yaml.root(), "family", fmt::format("'{}' is not known: only tag36h11 is", family.substr(0, 40)));
  TagSurvey survey;
  survey.size_m = yaml.positive(yaml.root(), "size_m");
  if (yaml.ok() && !(survey.size_m >= kSmallest_m && survey.size_m <= kLargest_m))
    yaml.complain(yaml.root(), "size_m", fmt::format("{:g} m is not between 1 cm and 3 m; sizes are in metres", survey.size_m));
  const YAML::Node tags = yaml.get(yaml.root(), "tags");
  if (yaml.ok() && !(tags.IsDefined() && tags.IsSequence() && tags.size() > 0))
    yaml.complain(yaml.root(), "tags", "is not a list of tags");
  if (yaml.ok())
    for (const YAML::Node& tag : tags)
      if (yaml.ok()) read_tag(yaml, tag, survey);
  if (!yaml.ok()) return yaml.error();
  return survey;
}

Result<TagSurvey> load_tags(const std::string& path) {
  const Result<std::string> text = read_file(path, kLargestSurvey_bytes);
  if (!text) return text.error();
  return parse_tags(*text, path);
}

std::string tags_to_yaml(const TagSurvey& survey) {
  std::string out = fmt::format("family: tag36h11\nsize_m: {}\ntags:\n", survey.size_m);
  for (const auto& [id, T] : survey.T_AT)
    if (!TagAnchor{.T_AT = T}.has_place()) fmt::format_to(std::back_inserter(out), "  - {{id: {}}}\n", id);
    else
      fmt::format_to(std::back_inserter(out), "  - {{id: {}, position_m: [{}, {}, {}], orientation_wxyz: [{}, {}, {}, {}]}}\n",
                     id, T.p.x(), T.p.y(), T.p.z(), T.q.w(), T.q.x(), T.q.y(), T.q.z());
  return out;
}

}  // namespace fbvins
