// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/mask_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <vector>

#include "fbvins/io/file_source.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace {

/// Rectangles that make up a mask, and shapes of a calibration, at most: eight cameras' masks then fit into one file.
constexpr std::size_t kMostShapes = 5000;
/// A drawn mask has few pixels between black and white, at smoothed edges; a photograph has many.
constexpr double kMostGrey = 0.05;
constexpr int kBlack = 32, kWhite = 223;

double grey_share(const Image& picture) {
  const auto pixels = static_cast<std::ptrdiff_t>(picture.width()) * picture.height();
  const std::uint8_t* first = picture.row(0);
  return static_cast<double>(std::count_if(first, first + pixels, [](int grey) { return grey > kBlack && grey < kWhite; })) /
         static_cast<double>(pixels);
}

/// A list of lists of `count` finite numbers.
std::vector<std::vector<double>> read_shapes(YamlReader& yaml, const YAML::Node& map, const std::string& field, std::size_t count,
                                             const char* numbers) {
  std::vector<std::vector<double>> shapes;
  const YAML::Node list = yaml.get(map, field);
  if (!list.IsDefined()) return shapes;
  if (!list.IsSequence() || list.size() > kMostShapes)
    return yaml.complain(map, field, fmt::format("is not a list of at most {} shapes {}", kMostShapes, numbers)), shapes;
  for (const YAML::Node& entry : list) {
    std::vector<double>& shape = shapes.emplace_back();
    if (entry.IsSequence() && entry.size() == count)
      for (const YAML::Node& number : entry) {
        const auto value = number.IsScalar() ? parse_double(number.Scalar()) : std::nullopt;
        if (value && std::isfinite(*value)) shape.push_back(*value);
      }
    if (shape.size() == count) continue;
    yaml.complain(map, field, fmt::format("its number {} is not {}", shapes.size(), numbers));
    return {};
  }
  return shapes;
}

void hide_picture(YamlReader& yaml, const YAML::Node& map, const ReadBeside& read, Image& seen) {
  const std::string name = yaml.word(map, "mask");
  if (!yaml.ok()) return;
  if (!read) return yaml.complain(map, "mask", "names a file, and here no file belongs to the calibration");
  const Result<std::string> bytes = read(name);
  if (!bytes) return yaml.complain(map, "mask", bytes.error().message);
  const Result<Image> picture = decode_image(*bytes);
  if (!picture) return yaml.complain(map, "mask", fmt::format("{}: {}", name, picture.error().message));
  if (picture->width() != seen.width() || picture->height() != seen.height())
    return yaml.complain(map, "mask",
                         fmt::format("{} has {} x {} pixels, the camera {} x {}", name, picture->width(), picture->height(),
                                     seen.width(), seen.height()));
  if (grey_share(*picture) > kMostGrey)
    return yaml.complain(
        map, "mask", fmt::format("{} is no mask: {:.0f} % of it is neither black nor white", name, 100 * grey_share(*picture)));
  if (Mask(*picture).rectangles().size() > kMostShapes)
    return yaml.complain(map, "mask", fmt::format("{} is no mask: it has more than {} separate parts", name, kMostShapes));
  seen = *picture;
}

/// `shape_of` takes the numbers to a shape that hide() takes.
template <class ShapeOf>
void hide_shapes(YamlReader& yaml, const YAML::Node& map, const std::string& field, std::size_t count, const char* numbers,
                 const ShapeOf& shape_of, Image& seen) {
  const auto shapes = read_shapes(yaml, map, field, count, numbers);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (shapes[i].back() > 0 && shapes[i][2] > 0 && hide(seen, shape_of(shapes[i]))) continue;
    return yaml.complain(map, field,
                         fmt::format("its number {} holds no pixel of the image of {} x {}", i + 1, seen.width(), seen.height()));
  }
}

}  // namespace

ReadBeside files_beside(const std::string& calibration_path) {
  return [folder = std::filesystem::path(calibration_path).parent_path()](const std::string& name) {
    return read_file((folder / name).string(), kLargestMask_bytes);
  };
}

std::shared_ptr<const Mask> read_mask(YamlReader& yaml, const YAML::Node& map, const Camera& camera, const ReadBeside& read) {
  const bool picture = yaml.has(map, "mask"), rectangles = yaml.has(map, "mask_rectangles"),
             circles = yaml.has(map, "mask_circles");
  if (!yaml.ok() || !(picture || rectangles || circles)) return nullptr;
  if (std::int64_t{1} * camera.width() * camera.height() > kLargestImage_px)
    return yaml.complain(map, "resolution", "has too many pixels"), nullptr;
  Image seen(camera.width(), camera.height(), 255);
  if (picture) hide_picture(yaml, map, read, seen);
  hide_shapes(
      yaml, map, "mask_rectangles", 4, "[x, y, width, height]",
      [](const std::vector<double>& n) {
        return MaskRectangle{n[0], n[1], n[2], n[3]};
      },
      seen);
  hide_shapes(
      yaml, map, "mask_circles", 3, "[x, y, radius]",
      [](const std::vector<double>& n) {
        return MaskCircle{n[0], n[1], n[2]};
      },
      seen);
  if (!yaml.ok()) return nullptr;
  auto mask = std::make_shared<const Mask>(seen);
  if (mask->hidden_share() == 0) return nullptr;
  if (!mask->hides_all(0, 0, mask->width(), mask->height())) return mask;
  yaml.complain(map, picture ? "mask" : rectangles ? "mask_rectangles" : "mask_circles", "hides all of the image");
  return nullptr;
}

std::string mask_text(const Camera& camera, const char* indent) {
  if (!camera.mask()) return "";
  std::string shapes;
  for (const MaskRectangle& r : camera.mask()->rectangles())
    shapes += fmt::format("{}[{}, {}, {}, {}]", shapes.empty() ? "" : ", ", r.x, r.y, r.width, r.height);
  return fmt::format("{}mask_rectangles: [{}]\n", indent, shapes);
}

}  // namespace fbvins
