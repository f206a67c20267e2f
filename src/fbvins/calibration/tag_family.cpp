// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/tag_family.hpp"

#include <fmt/format.h>

#include <algorithm>

#ifdef FBVINS_WITH_APRILTAG
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#endif

namespace fbvins {

#ifdef FBVINS_WITH_APRILTAG

namespace {

struct FamilyDeleter {
  void operator()(apriltag_family_t* family) const { tag36h11_destroy(family); }
};
using Family = std::unique_ptr<apriltag_family_t, FamilyDeleter>;

/// The library's family describes where in a black square the cells of the pattern are.
Family family_of(int border) {
  Family out(tag36h11_create());
  const int more = border - kLibraryBorder;
  out->width_at_border += 2 * more, out->total_width += 2 * more;
  for (uint32_t bit = 0; bit < out->nbits; ++bit)
    out->bit_x[bit] += static_cast<uint32_t>(more), out->bit_y[bit] += static_cast<uint32_t>(more);
  return out;
}

}  // namespace

Result<TagCells> tag_cells(int id) {
  const Family family(tag36h11_create());
  if (id < 0 || id >= static_cast<int>(family->ncodes))
    return Error{ErrorCode::invalid_argument, fmt::format("tag36h11 has no tag {}", id)};
  // All cells are black but for the bits that are set, the first one being the highest.
  TagCells out{};
  for (auto& row : out) row.fill(true);
  for (uint32_t bit = 0; bit < family->nbits; ++bit)
    out[family->bit_y[bit]][family->bit_x[bit]] = (family->codes[id] >> (family->nbits - 1 - bit) & 1u) == 0;
  return out;
}

struct TagDetector::State {
  std::vector<Family> families;
  apriltag_detector_t* detector = apriltag_detector_create();

  explicit State(const std::vector<int>& borders) {
    for (const int border : borders)  // one wrong bit is corrected: 11 differ between tags
      apriltag_detector_add_family_bits(detector, families.emplace_back(family_of(border)).get(), 1);
    detector->quad_decimate = 1;
    detector->nthreads = 1;
  }
  ~State() { apriltag_detector_destroy(detector); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
};

Result<TagDetector> TagDetector::create(const std::vector<int>& borders) { return TagDetector(std::make_unique<State>(borders)); }

namespace {

/// The image with black parts one pixel smaller: the largest of each pixel and its neighbours.
Image with_smaller_black(const ImageView& image) {
  Image wide(image.width, image.height), out(image.width, image.height);
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* in = image.row(y);
    std::uint8_t* row = wide.row(y);
    for (int x = 0; x < image.width; ++x)
      row[x] = std::max({in[std::max(x - 1, 0)], in[x], in[std::min(x + 1, image.width - 1)]});
  }
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t *above = wide.row(std::max(y - 1, 0)), *here = wide.row(y),
                       *below = wide.row(std::min(y + 1, image.height - 1));
    std::uint8_t* row = out.row(y);
    for (int x = 0; x < image.width; ++x) row[x] = std::max({above[x], here[x], below[x]});
  }
  return out;
}

void detect(apriltag_detector_t* detector, const ImageView& image, std::vector<TagDetection>& out) {
  // The library reads only, but does not say so.
  image_u8_t view{image.width, image.height, static_cast<int32_t>(image.stride), const_cast<uint8_t*>(image.data)};
  zarray_t* found = apriltag_detector_detect(detector, &view);
  for (int i = 0; i < zarray_size(found); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found, i, &detection);
    TagDetection tag;
    tag.id = detection->id;
    tag.border = kLibraryBorder + (detection->family->width_at_border - 8) / 2;
    tag.wrong_cells = detection->hamming;
    for (int k = 0; k < 4; ++k) tag.corners[k] = Vec2(detection->p[k][0] - 0.5, detection->p[k][1] - 0.5);
    // One that was found before in the same place.
    const bool known = std::ranges::any_of(out, [&](const TagDetection& s) {
      return s.id == tag.id && s.border == tag.border &&
             (s.corners[0] - tag.corners[0]).norm() < 0.5 * (s.corners[0] - s.corners[2]).norm();
    });
    if (!known) out.push_back(tag);
  }
  apriltag_detections_destroy(found);
}

}  // namespace

std::vector<TagDetection> TagDetector::find(const ImageView& image, int enough) {
  std::vector<TagDetection> out;
  if (image.empty()) return out;
  // In a blurred image the tags of a grid hang together at their corners, by the squares between them, and few are found. With
  // black a pixel smaller they come apart; small tags, whose cells would vanish, are found in the image itself.
  detect(state_->detector, with_smaller_black(image).view(), out);
  const auto of_border = [&](int border) { return std::ranges::count(out, border, &TagDetection::border); };
  if (std::max(of_border(kLibraryBorder), of_border(kKalibrBorder)) < enough) detect(state_->detector, image, out);
  std::ranges::stable_sort(out, {}, &TagDetection::id);
  return out;
}

std::vector<TagDetection> TagDetector::find_alone(const ImageView& image) {
  std::vector<TagDetection> out;
  if (image.empty()) return out;
  detect(state_->detector, image, out);
  std::ranges::stable_sort(out, {}, &TagDetection::id);
  return out;
}

#else

namespace {

Error not_built() {
  return {ErrorCode::unsupported, "tags need libapriltag (Debian: libapriltag-dev), and this program was built without it"};
}

}  // namespace

struct TagDetector::State {};
Result<TagCells> tag_cells(int) { return not_built(); }
Result<TagDetector> TagDetector::create(const std::vector<int>&) { return not_built(); }
std::vector<TagDetection> TagDetector::find(const ImageView&, int) { return {}; }
std::vector<TagDetection> TagDetector::find_alone(const ImageView&) { return {}; }

#endif

bool is_black(const TagCells& cells, int border, int row, int column) {
  const int more = border - kLibraryBorder, r = row - more, c = column - more;
  return r < 0 || c < 0 || r > 7 || c > 7 || cells[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
}

TagDetector::TagDetector(std::unique_ptr<State> state) : state_(std::move(state)) {}
TagDetector::TagDetector(TagDetector&&) noexcept = default;
TagDetector& TagDetector::operator=(TagDetector&&) noexcept = default;
TagDetector::~TagDetector() = default;

}  // namespace fbvins
