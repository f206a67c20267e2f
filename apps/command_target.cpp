// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "fbvins/calibration/target_drawing.hpp"
#include "fbvins/calibration/target_file.hpp"
#include "fbvins/core/atomic_file.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(Writes the board as PDF and SVG in true size, and its description for `fbvins calibrate` and Kalibr as YAML.
Print without scaling, and measure both rulers. Glue the print to something stiff and flat.

examples:
  fbvins target                                  AprilGrid of 6 x 6 tags, as large as fits on A4: target.pdf, .svg, .yaml
  fbvins target --paper A0 --size 0.088 --out april_6x6
  fbvins target --kind chessboard --columns 8 --rows 6 --paper A3
)";

struct Arguments {
  std::string kind = "aprilgrid", paper = "A4", out = "target";
  int columns = 6, rows = 6;
  double size_m = 0, spacing = 0;
  int border = kKalibrBorder;
};

int make_target(const Arguments& a) {
  Board board;
  board.kind = a.kind == "aprilgrid" ? BoardKind::aprilgrid : a.kind == "charuco" ? BoardKind::charuco : BoardKind::chessboard;
  board.columns = a.columns;
  board.rows = a.rows;
  board.spacing = a.spacing > 0 ? a.spacing : board.kind == BoardKind::aprilgrid ? 0.3 : 0.75;
  if (board.kind == BoardKind::chessboard) board.spacing = 0;
  board.size_m = a.size_m > 0 ? a.size_m : largest_size_m(board, a.paper);
  if (!(board.size_m > 0)) return fail(fmt::format("{} x {} are too many for {}", a.columns, a.rows, a.paper));
  const Result<Drawing> page = draw_target(board, a.paper, a.border);
  if (!page) return fail(page.error().message);
  if (const std::string folder = std::filesystem::path(a.out).parent_path().string(); !folder.empty())
    if (Result<void> made = make_folders(folder); !made) return fail(made.error().message);
  for (const Result<void>& done :
       {write_file_atomically(a.out + ".pdf", to_pdf(*page)), write_file_atomically(a.out + ".svg", to_svg(*page)),
        write_file_atomically(a.out + ".yaml", target_to_yaml(board))})
    if (!done) return fail(done.error().message);
  fmt::print("{} on {}: {}, and .svg, .yaml\nprint it without scaling, then measure the rulers\n", board.describe(), a.paper,
             bold(a.out + ".pdf"));
  return kOk;
}

}  // namespace

void add_target_command(CLI::App& program, int& exit_code) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("target", kTargetDescription);
  command->footer(kExamples);
  command->add_option("--kind", a->kind, "aprilgrid, charuco or chessboard")
      ->check(CLI::IsMember({"aprilgrid", "charuco", "chessboard"}))
      ->capture_default_str();
  command->add_option("--columns", a->columns, "tags, squares (charuco), or inner corners (chessboard) in a row")
      ->capture_default_str();
  command->add_option("--rows", a->rows, "of them in a column")->capture_default_str();
  command->add_option("--size", a->size_m, "edge of a tag or square, m; left out: as large as fits")->check(CLI::PositiveNumber);
  command->add_option("--spacing", a->spacing, "aprilgrid: gap between tags, charuco: marker, as a part of --size (0.3, 0.75)")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--border", a->border,
                   "aprilgrid: black cells around the pattern of a tag; 2 as Kalibr's boards have, 1 as libapriltag's tags")
      ->check(CLI::IsMember({kLibraryBorder, kKalibrBorder}))
      ->capture_default_str();
  command->add_option("--paper", a->paper, "A4, A3, A2, A1 or A0")->capture_default_str();
  command->add_option("--out", a->out, "name of the files, without .pdf")->capture_default_str();
  command->callback([a, &exit_code] { exit_code = make_target(*a); });
}

}  // namespace fbvins::app
