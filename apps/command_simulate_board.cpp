// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <memory>

#include "apps/commands.hpp"
#include "apps/progress.hpp"
#include "apps/simulated_boards.hpp"
#include "apps/terminal.hpp"
#include "fbvins/boards/board_flight.hpp"
#include "fbvins/boards/hung_tags.hpp"
#include "fbvins/calibration/lens_jacobian.hpp"
#include "fbvins/calibration/target_file.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kBoardExamples =
    R"(A stereo rig held by hand before a board in a room: images with blur and noise, IMU, exact truth in the folder's own calibration.
The same options and seed give the same bytes.

examples:
  fbvins simulate board --out board && fbvins calibrate board --target board/target.yaml
  fbvins simulate board --lens ds --seconds 30 --seed 7 --out wide
)";

/// Edge of a tag's black square.
constexpr double kTagSize_m = 0.2;

const std::map<std::string, bool HandMotion::*> kMovements = {{"distance", &HandMotion::distance},
                                                              {"across", &HandMotion::across},
                                                              {"up", &HandMotion::up},
                                                              {"aim", &HandMotion::aim},
                                                              {"roll", &HandMotion::roll}};

struct BoardArguments {
  BoardFlightOptions options;
  std::vector<std::string> movements;
  std::string target, out;
  bool quiet = false;
};

int render(BoardArguments& a) {
  if (!a.target.empty()) {
    const Result<Board> board = load_target(a.target);
    if (!board) return fail(board.error().message);
    a.options.board = *board;
  }
  for (const auto& [name, movement] : kMovements)
    a.options.motion.*movement = a.movements.empty() || std::ranges::find(a.movements, name) != a.movements.end();
  Progress progress(static_cast<int>(a.options.seconds * a.options.image_rate_hz), a.quiet);
  const Result<void> done = simulate_board(a.options, a.out, [&](int images, int) { progress.update(images); });
  if (!done) return fail(done.error().message);
  if (!a.quiet) fmt::print("{} in {}, with target.yaml\n", a.options.board.describe(), bold(a.out));
  return kOk;
}

}  // namespace

void add_simulate_board_command(CLI::App& simulate, int& exit_code) {
  auto a = std::make_shared<BoardArguments>();
  CLI::App* command = simulate.add_subcommand("board", kSimulateBoardDescription);
  command->footer(kBoardExamples);
  command->add_option("--out", a->out, "folder for the recording")->required();
  command->add_option("--target", a->target, "the board; left out: AprilGrid, 6 x 6 tags of 88 mm");
  command->add_option("--lens", a->options.lens, "lens model of all cameras")
      ->check(CLI::IsMember(lens_names()))
      ->capture_default_str();
  command->add_option("--cameras", a->options.cameras, "how many: the pair, and one to each side of it")
      ->check(CLI::Range(1, 4))
      ->capture_default_str();
  command->add_option("--seconds", a->options.seconds, "length")->check(CLI::Range(1.0, 3600.0))->capture_default_str();
  command->add_option("--rate", a->options.image_rate_hz, "images a second")
      ->check(CLI::Range(0.5, 200.0))
      ->capture_default_str();
  command->add_option("--time-offset", a->options.time_offset_ms, "ms, IMU's stamp less image's")
      ->check(CLI::Range(-400.0, 400.0))
      ->capture_default_str();
  command->add_option("--later", a->options.later_ms, "ms by which each camera takes its image later than the one before it")
      ->check(CLI::Range(-40.0, 40.0))
      ->capture_default_str();
  command->add_option("--line-delay", a->options.line_delay_us, "us from row to row of a rolling shutter")
      ->check(CLI::Range(0.0, 200.0))
      ->capture_default_str();
  command->add_option("--imu-scale", a->options.imu_scale, "standard deviation of each axis' scale of the IMU, 0.01 is 1 %")
      ->check(CLI::Range(0.0, 0.1))
      ->capture_default_str();
  command->add_option("--imu-axes", a->options.imu_axes_deg, "degrees, standard deviation of each axis' direction")
      ->check(CLI::Range(0.0, 5.0))
      ->capture_default_str();
  command
      ->add_option("--motion", a->movements, "the hand's only movements: distance, across, up, aim (at the board's parts), roll")
      ->delimiter(',')
      ->check(CLI::IsMember(kMovements));
  command->add_option("--missing-tags", a->options.missing_tags, "numbers of tags whose places stay white")->delimiter(',');
  command->add_option("--seed", a->options.seed, "of motion and noise")->check(CLI::NonNegativeNumber)->capture_default_str();
  command->add_flag("--quiet", a->quiet, "print nothing but errors and warnings");
  command->callback([a, &exit_code] { exit_code = render(*a); });
}

Result<std::string> hang_simulated_tags(World& world, const Simulation& simulation, int count) {
  const Result<TagSurvey> tags = hang_tags(world, simulation, count, kTagSize_m);
  if (!tags) return tags.error();
  return tags_to_yaml(*tags);
}

}  // namespace fbvins::app
