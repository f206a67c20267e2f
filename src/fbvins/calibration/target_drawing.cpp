// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/target_drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "fbvins/calibration/target_file.hpp"

namespace fbvins {
namespace {

constexpr double kMargin_mm = 8, kRuler_mm = 13;  ///< around the page; rulers at the left and at the bottom

std::optional<Vec2> paper_mm(std::string_view name) {
  constexpr std::pair<std::string_view, std::pair<double, double>> kPapers[] = {
      {"A4", {210, 297}}, {"A3", {297, 420}}, {"A2", {420, 594}}, {"A1", {594, 841}}, {"A0", {841, 1189}}};
  for (const auto& [known, size] : kPapers)
    if (name == known) return Vec2(size.first, size.second);
  return std::nullopt;
}

/// Width and height of all that is black.
Vec2 extent_mm(const Board& board) {
  const double size_mm = 1e3 * board.size_m;
  if (board.kind == BoardKind::aprilgrid) {
    const double pitch = 1 + board.spacing;
    return size_mm * Vec2(board.columns * pitch + board.spacing, board.rows * pitch + board.spacing);
  }
  const int more = board.kind == BoardKind::chessboard ? 1 : 0;
  return size_mm * Vec2(board.columns + more, board.rows + more);
}

Vec2 room_mm(const Vec2& page) { return {page.x() - 2 * kMargin_mm - kRuler_mm, page.y() - 2 * kMargin_mm - kRuler_mm}; }

bool fits(const Board& board, const Vec2& page) {
  const Vec2 extent = extent_mm(board), room = room_mm(page);
  return extent.x() <= room.x() + 1e-9 && extent.y() <= room.y() + 1e-9;
}

/// White cells of a tag over its black square; neighbours in a row are one rectangle.
Result<void> draw_tag(int id, int border, double left, double top, double size, Drawing& out) {
  const Result<TagCells> cells = tag_cells(id);
  if (!cells) return cells.error();
  out.rectangles.push_back({left, top, size, size});
  const int across = cells_across(border);
  const double cell = size / across;
  for (int row = 0; row < across; ++row)
    for (int from = 0, to = 0; from < across; from = to + 1) {
      for (to = from; to < across && !is_black(*cells, border, row, to);) ++to;
      if (to > from) out.rectangles.push_back({left + from * cell, top + row * cell, (to - from) * cell, cell, false});
    }
  return {};
}

/// Tag 0 at the bottom left, rows upwards; a black square in each crossing of the gaps makes every corner of a tag a saddle.
Result<void> draw_aprilgrid(const Board& board, int border, double left, double top, Drawing& out) {
  const double size = 1e3 * board.size_m, gap = board.spacing * size, pitch = size + gap;
  for (int row = 0; row <= board.rows; ++row)
    for (int column = 0; column <= board.columns; ++column)
      out.rectangles.push_back({left + column * pitch, top + row * pitch, gap, gap});
  for (int tag = 0; tag < board.columns * board.rows; ++tag) {
    const int column = tag % board.columns, row = board.rows - 1 - tag / board.columns;
    if (Result<void> drawn = draw_tag(tag, border, left + gap + column * pitch, top + gap + row * pitch, size, out); !drawn)
      return drawn;
  }
  out.origin_mm = {left + gap, top + board.rows * pitch};
  return {};
}

/// Black at the top left; ChArUco has tags in its white squares, counted row by row.
Result<void> draw_squares(const Board& board, double left, double top, Drawing& out) {
  const bool tags = board.kind == BoardKind::charuco;
  const double size = 1e3 * board.size_m, inset = 0.5 * (1 - board.spacing) * size;
  int tag = 0;
  for (int row = 0; row < board.rows + (tags ? 0 : 1); ++row)
    for (int column = 0; column < board.columns + (tags ? 0 : 1); ++column) {
      const double x = left + column * size, y = top + row * size;
      if ((row + column) % 2 == 0) out.rectangles.push_back({x, y, size, size});
      else if (tags)
        if (Result<void> drawn = draw_tag(tag++, kLibraryBorder, x + inset, y + inset, board.spacing * size, out); !drawn)
          return drawn;
    }
  out.origin_mm = {left + size, top + size};
  return {};
}

/// A line every 10 mm, from 0 to a whole number of 50 mm.
void draw_rulers(const std::string& board, Drawing& out) {
  const double x0 = kMargin_mm + kRuler_mm, y0 = out.height_mm - kMargin_mm - 4;
  const int across = 50 * static_cast<int>((out.width_mm - x0 - kMargin_mm) / 50);
  const int up = 50 * static_cast<int>((y0 - kMargin_mm) / 50);
  constexpr double kLine_mm = 0.25;
  out.rectangles.push_back({x0, y0 - kLine_mm / 2, static_cast<double>(across), kLine_mm});
  for (int mm = 0; mm <= across; mm += 10)
    out.rectangles.push_back({x0 + mm - kLine_mm / 2, y0 - (mm % 50 == 0 ? 4 : 2), kLine_mm, mm % 50 == 0 ? 4.0 : 2.0});
  const double x1 = kMargin_mm + 4;
  out.rectangles.push_back({x1 - kLine_mm / 2, y0 - up, kLine_mm, static_cast<double>(up)});
  for (int mm = 0; mm <= up; mm += 10) out.rectangles.push_back({x1, y0 - mm - kLine_mm / 2, mm % 50 == 0 ? 4.0 : 2.0, kLine_mm});
  out.texts.push_back({x0, y0 + 3.5, 3, fmt::format("{}. {} mm from end to end: measure it", board, across)});
  out.texts.push_back({x1 - 1, y0, 3, fmt::format("{} mm from end to end", up), true});
}

std::string escaped(std::string_view text, bool xml) {
  std::string out;
  for (const char c : text) {
    if (xml && (c == '<' || c == '&')) out += c == '<' ? "&lt;" : "&amp;";
    else if (!xml && (c == '(' || c == ')' || c == '\\')) out += std::string("\\") + c;
    else out += c;
  }
  return out;
}

}  // namespace

double largest_size_m(Board board, std::string_view paper) {
  const auto page = paper_mm(paper);
  if (!page) return 0;
  board.size_m = 1e-3;
  const Vec2 one = extent_mm(board);
  const auto largest = [&](const Vec2& room) { return std::floor(std::min(room.x() / one.x(), room.y() / one.y()) + 1e-9); };
  return 1e-3 * std::max({0.0, largest(room_mm(*page)), largest(room_mm({page->y(), page->x()}))});
}

Result<Drawing> draw_target(const Board& board, std::string_view paper, int border) {
  if (std::string problem = impossible(board); !problem.empty()) return Error{ErrorCode::invalid_argument, problem};
  const auto upright = paper_mm(paper);
  if (!upright)
    return Error{ErrorCode::invalid_argument, fmt::format("'{}' is none of the papers A4, A3, A2, A1, A0", paper.substr(0, 20))};
  const Vec2 page = fits(board, *upright) ? *upright : Vec2(upright->y(), upright->x());
  const Vec2 extent = extent_mm(board), room = room_mm(page);
  if (!fits(board, page))
    return Error{
        ErrorCode::invalid_argument,
        fmt::format("the board is {:.0f} x {:.0f} mm, and {} has room for {:.0f} x {:.0f} mm: a size of {:g} m would fit",
                    extent.x(), extent.y(), paper, room.x(), room.y(), largest_size_m(board, paper))};
  Drawing out{page.x(), page.y(), {}, {}, Vec2::Zero()};
  const double left = kMargin_mm + kRuler_mm + 0.5 * (room.x() - extent.x()), top = kMargin_mm + 0.5 * (room.y() - extent.y());
  if (Result<void> drawn = board.kind == BoardKind::aprilgrid ? draw_aprilgrid(board, border, left, top, out)
                                                              : draw_squares(board, left, top, out);
      !drawn)
    return drawn.error();
  draw_rulers(board.describe(), out);
  return out;
}

std::string to_svg(const Drawing& drawing) {
  std::string out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}mm\" "
      "height=\"{1}mm\" viewBox=\"0 0 {0} {1}\" shape-rendering=\"crispEdges\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n",
      drawing.width_mm, drawing.height_mm);
  for (const DrawnRectangle& r : drawing.rectangles)
    out += fmt::format("<rect x=\"{:.4f}\" y=\"{:.4f}\" width=\"{:.4f}\" height=\"{:.4f}\" fill=\"{}\"/>\n", r.x, r.y, r.width,
                       r.height, r.black ? "black" : "white");
  for (const DrawnText& t : drawing.texts)
    out += fmt::format(
        "<text x=\"{0:.3f}\" y=\"{1:.3f}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"{2}\"{3}>{4}</text>\n", t.x,
        t.y, t.height, t.upwards ? fmt::format(" transform=\"rotate(-90 {:.3f} {:.3f})\"", t.x, t.y) : "", escaped(t.text, true));
  return out + "</svg>\n";
}

std::string to_pdf(const Drawing& drawing) {
  constexpr double kPoints = 72 / 25.4;  ///< a millimetre
  std::string page = fmt::format("{0:.6f} 0 0 {0:.6f} 0 0 cm\n", kPoints);
  bool black = true;
  page += "0 g\n";
  for (const DrawnRectangle& r : drawing.rectangles) {
    if (r.black != black) page += r.black ? "0 g\n" : "1 g\n";
    black = r.black;
    page += fmt::format("{:.4f} {:.4f} {:.4f} {:.4f} re f\n", r.x, drawing.height_mm - r.y - r.height, r.width, r.height);
  }
  page += "0 g\nBT\n";
  for (const DrawnText& t : drawing.texts)
    page += fmt::format("/F1 {} Tf {} {:.3f} {:.3f} Tm ({}) Tj\n", t.height, t.upwards ? "0 1 -1 0" : "1 0 0 1", t.x,
                        drawing.height_mm - t.y, escaped(t.text, false));
  page += "ET\n";
  const std::string objects[] = {
      "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      fmt::format(
          "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4f} {:.4f}] /Contents 4 0 R /Resources << /Font << /F1 5 0 R >> >> >>",
          kPoints * drawing.width_mm, kPoints * drawing.height_mm),
      fmt::format("<< /Length {} >>\nstream\n{}endstream", page.size(), page),
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>"};
  std::string out = "%PDF-1.4\n", table;
  int number = 0;
  for (const std::string& object : objects) {
    table += fmt::format("{:010} 00000 n \n", out.size());
    out += fmt::format("{} 0 obj\n{}\nendobj\n", ++number, object);
  }
  const std::size_t start = out.size();
  return out + fmt::format("xref\n0 {0}\n0000000000 65535 f \n{1}trailer\n<< /Size {0} /Root 1 0 R >>\nstartxref\n{2}\n%%EOF\n",
                           number + 1, table, start);
}

}  // namespace fbvins
