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
  Family family{tag36h11_create()};
  apriltag_detector_t* detector = apriltag_detector_create();

  State() {
    apriltag_detector_add_family_bits(detector, family.get(), 1);  // one wrong bit is corrected: 11 differ between tags
    detector->quad_decimate = 1;
    detector->nthreads = 1;
  }
  ~State() { apriltag_detector_destroy(detector); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
};

Result<TagDetector> TagDetector::create() { return TagDetector(std::make_unique<State>()); }

std::vector<TagDetection> TagDetector::find(const ImageView& image) {
  std::vector<TagDetection> out;
  if (image.empty()) return out;
  // The library reads only, but does not say so.
  image_u8_t view{image.width, image.height, static_cast<int32_t>(image.stride), const_cast<uint8_t*>(image.data)};
  zarray_t* found = apriltag_detector_detect(state_->detector, &view);
  for (int i = 0; i < zarray_size(found); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found, i, &detection);
    TagDetection tag;
    tag.id = detection->id;
    tag.wrong_cells = detection->hamming;
    for (int k = 0; k < 4; ++k) tag.corners[k] = Vec2(detection->p[k][0] - 0.5, detection->p[k][1] - 0.5);
    out.push_back(tag);
  }
  apriltag_detections_destroy(found);
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
Result<TagDetector> TagDetector::create() { return not_built(); }
std::vector<TagDetection> TagDetector::find(const ImageView&) { return {}; }

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
