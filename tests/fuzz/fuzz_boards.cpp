// SPDX-License-Identifier: Apache-2.0
// What is read of boards and places: images of tags, and files of boards, corners, tags and positions.
#include <algorithm>
#include <optional>

#include "fbvins/calibration/board_detector.hpp"
#include "fbvins/calibration/board_image.hpp"
#include "fbvins/calibration/detections_file.hpp"
#include "fbvins/calibration/tag_survey.hpp"
#include "fbvins/calibration/target_file.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/io/anchor_file.hpp"
#include "tests/fuzz/fuzz_targets.hpp"
#include "tests/fuzz/require.hpp"

namespace fbvins::fuzz {
namespace {

constexpr int kWidth = 72;
const Board kBoard{.columns = 2, .rows = 1, .size_m = 0.1, .spacing = 0.3};

/// Rows of kWidth grey values; what is left over is no row.
std::optional<Image> picture(std::string_view bytes) {
  const int rows = static_cast<int>(std::min<std::size_t>(bytes.size() / kWidth, 200));
  if (rows == 0) return std::nullopt;
  Image image(kWidth, rows, 0);
  for (int y = 0; y < rows; ++y)
    std::copy_n(bytes.data() + static_cast<std::ptrdiff_t>(y) * kWidth, kWidth, reinterpret_cast<char*>(image.row(y)));
  return image;
}

}  // namespace

/// Two tags, tilted a little, with either border.
std::vector<std::string> tag_seeds() {
  std::vector<std::string> out;
  const Camera camera(PinholeRadtan{90, 90, 36, 20}, kWidth, 40);
  for (const int border : {kLibraryBorder, kKalibrBorder}) {
    const auto pattern = BoardPattern::create(kBoard, border);
    if (!pattern) return {std::string(40 * kWidth, '\x7f')};  // a build without tags
    Rng rng(3);
    const Quat facing = so3_exp(Vec3(0.2, 0.1, 0.05)) * Quat(0, 1, 0, 0);
    const Pose<Cn, T> T_CnT(facing, Vec3(0, 0, 0.36) - facing * Vec3(0.115, 0.05, 0));
    const Image image = BoardCamera(camera, *pattern).render({T_CnT}, {.noise = 1}, rng);
    std::string bytes;
    for (int y = 0; y < image.height(); ++y) bytes.append(reinterpret_cast<const char*>(image.row(y)), kWidth);
    out.push_back(std::move(bytes));
  }
  return out;
}

/// Whatever is in the image: corners of the board, each once, in the image.
void fuzz_tags(std::string_view bytes) {
  static auto detector = BoardDetector::create(kBoard);
  const std::optional<Image> image = picture(bytes);
  if (!detector || !image) return;
  const BoardDetection seen = detector->find(image->view());
  require(seen.tags >= 0 && seen.tags <= 2 && static_cast<int>(seen.corners.size()) <= 4 * seen.tags);
  for (std::size_t i = 0; i < seen.corners.size(); ++i) {
    const auto& [index, pixel] = seen.corners[i];
    require(index >= 0 && index < kBoard.corner_count() && (i == 0 || seen.corners[i - 1].index < index));
    require(pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < image->width() - 0.5 && pixel.y() < image->height() - 0.5);
  }
}

std::vector<std::string> board_file_seeds() {
  return {"target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\ntagSpacing: 0.3\n",
          "target_type: checkerboard\ntargetCols: 7\ntargetRows: 6\ncolSpacingMeters: 0.03\nrowSpacingMeters: 0.03\n",
          "target_type: charuco\nsquareCols: 7\nsquareRows: 6\nsquareSize: 0.03\nmarkerSize: 0.02\n",
          "# camera 0: 752 x 480\ntimestamp_ns,camera,corner,u_px,v_px\n1000,0,0,10.5,20.25\n1000,0,3,11,21\n2000,1,5,30,40\n",
          "family: tag36h11\nsize_m: 0.20\ntags:\n  - {id: 3, position_m: [4.0, 1.2, 1.6], facing_deg: 180}\n"
          "  - {id: 7, position_m: [2.0, 2.0, 0.0], orientation_wxyz: [1, 0, 0, 0]}\n  - {id: 9}\n",
          "timestamp_ns,x,y,z,sx,sy,sz,px,py,pz\n1000,1,2,3,0.1,0.1,0.1,0,0,0.1\n2000,,,3,,,0.1,0,0,0\n"};
}

void fuzz_board_files(std::string_view bytes) {
  const auto board = parse_target(std::string(bytes), "april.yaml");
  require_sentence(board);
  if (board) {
    require(impossible(*board).empty());
    require(parse_target(target_to_yaml(*board), "again").ok());
  }
  const auto detections = parse_detections(bytes, "detections.csv");
  require_sentence(detections);
  if (detections)
    for (const BoardView& view : detections->views)
      for (const BoardCorner& corner : view.corners) require(corner.index >= 0 && corner.pixel.allFinite());
  const auto tags = parse_tags(std::string(bytes), "tags.yaml");
  require_sentence(tags);
  if (tags) require(tags->size_m > 0);
  require_sentence(parse_anchors(bytes, "positions.csv"));
}

}  // namespace fbvins::fuzz
