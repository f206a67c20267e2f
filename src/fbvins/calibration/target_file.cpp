// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/target_file.hpp"

#include <fmt/format.h>

#include <cmath>

#include "fbvins/io/file_source.hpp"
#include "fbvins/io/yaml_reader.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestTarget_bytes = 1u << 20u;
constexpr double kSmallestSize_m = 1e-3, kLargestSize_m = 2;

int read_count(YamlReader& yaml, const std::string& field, int least) {
  const double value = yaml.number(yaml.root(), field);
  if (yaml.ok() && !(value >= least && value <= 100 && value == std::floor(value)))
    yaml.complain(yaml.root(), field, fmt::format("{:g} is not a whole number from {} to 100", value, least));
  return yaml.ok() ? static_cast<int>(value) : least;
}

double read_size_m(YamlReader& yaml, const std::string& field) {
  const double value = yaml.positive(yaml.root(), field);
  if (yaml.ok() && !(value >= kSmallestSize_m && value <= kLargestSize_m))
    yaml.complain(yaml.root(), field, fmt::format("{:g} m is not between 1 mm and 2 m; sizes are in metres", value));
  return value;
}

Board read_aprilgrid(YamlReader& yaml) {
  yaml.only(yaml.root(), {"target_type", "tagCols", "tagRows", "tagSize", "tagSpacing", "codeOffset"});
  Board board{.kind = BoardKind::aprilgrid, .columns = read_count(yaml, "tagCols", 1), .rows = read_count(yaml, "tagRows", 1)};
  board.size_m = read_size_m(yaml, "tagSize");
  board.spacing = yaml.positive(yaml.root(), "tagSpacing");
  if (yaml.ok() && !(board.spacing >= 0.01 && board.spacing <= 3))
    yaml.complain(yaml.root(), "tagSpacing",
                  fmt::format("{:g} is not between 0.01 and 3; it is the gap between tags as a part of tagSize", board.spacing));
  if (yaml.has(yaml.root(), "codeOffset") && yaml.number(yaml.root(), "codeOffset") != 0)
    yaml.complain(yaml.root(), "codeOffset", "only 0 is supported: the tags count from 0");
  if (yaml.ok() && board.columns * board.rows > kTagsOfFamily)
    yaml.complain(yaml.root(), "tagCols",
                  fmt::format("{} tags are more than the {} of tag36h11", board.columns * board.rows, kTagsOfFamily));
  return board;
}

Board read_chessboard(YamlReader& yaml) {
  yaml.only(yaml.root(), {"target_type", "targetCols", "targetRows", "colSpacingMeters", "rowSpacingMeters"});
  Board board{
      .kind = BoardKind::chessboard, .columns = read_count(yaml, "targetCols", 2), .rows = read_count(yaml, "targetRows", 2)};
  board.size_m = read_size_m(yaml, "colSpacingMeters");
  const double row_m = read_size_m(yaml, "rowSpacingMeters");
  if (yaml.ok() && row_m != board.size_m)
    yaml.complain(yaml.root(), "rowSpacingMeters", "differs from colSpacingMeters: only square fields are supported");
  board.spacing = 0;
  return board;
}

Board read_charuco(YamlReader& yaml) {
  yaml.only(yaml.root(), {"target_type", "squareCols", "squareRows", "squareSize", "markerSize"});
  Board board{
      .kind = BoardKind::charuco, .columns = read_count(yaml, "squareCols", 3), .rows = read_count(yaml, "squareRows", 3)};
  board.size_m = read_size_m(yaml, "squareSize");
  const double marker_m = read_size_m(yaml, "markerSize");
  if (yaml.ok() && !(marker_m < board.size_m)) yaml.complain(yaml.root(), "markerSize", "is not smaller than squareSize");
  board.spacing = marker_m / board.size_m;
  return board;
}

}  // namespace

Result<Board> parse_target(const std::string& text, const std::string& file) {
  YamlReader yaml(file, text);
  const std::string type = yaml.word(yaml.root(), "target_type");
  if (!yaml.ok()) return yaml.error();
  Board board;
  if (type == "aprilgrid") board = read_aprilgrid(yaml);
  else if (type == "checkerboard") board = read_chessboard(yaml);
  else if (type == "charuco") board = read_charuco(yaml);
  else
    yaml.complain(yaml.root(), "target_type",
                  fmt::format("'{}' is none of aprilgrid, checkerboard, charuco", type.substr(0, 40)));
  if (!yaml.ok()) return yaml.error();
  return board;
}

Result<Board> load_target(const std::string& path) {
  Result<std::string> text = read_file(path, kLargestTarget_bytes);
  if (!text) return text.error();
  return parse_target(*text, path);
}

std::string target_to_yaml(const Board& board) {
  if (board.kind == BoardKind::aprilgrid)
    return fmt::format(
        "target_type: 'aprilgrid'\ntagCols: {}\ntagRows: {}\ntagSize: {}  # m, edge of a tag's black square\n"
        "tagSpacing: {}  # gap between tags / tagSize\n",
        board.columns, board.rows, board.size_m, board.spacing);
  if (board.kind == BoardKind::chessboard)
    return fmt::format(
        "target_type: 'checkerboard'\ntargetCols: {}  # inner corners\ntargetRows: {}\n"
        "colSpacingMeters: {}\nrowSpacingMeters: {}\n",
        board.columns, board.rows, board.size_m, board.size_m);
  return fmt::format("target_type: 'charuco'\nsquareCols: {}\nsquareRows: {}\nsquareSize: {}  # m\nmarkerSize: {}  # m\n",
                     board.columns, board.rows, board.size_m, board.spacing * board.size_m);
}

std::string impossible(const Board& board) {
  // What is written is what is read: the reader judges.
  const Result<Board> read = parse_target(target_to_yaml(board), "board");
  return read ? "" : read.error().message;
}

}  // namespace fbvins
