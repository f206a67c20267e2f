// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "apps/commands.hpp"
#include "apps/mocap_report.hpp"
#include "apps/terminal.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/io/trajectory.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(MOCAP_FILE is an export of OptiTrack Motive (CSV), Vicon (CSV) or Qualisys (TSV, 6D), an MCAP with poses, or a TUM or
EuRoC file; ESTIMATE a trajectory file or the folder of a run. The pose of the markers on the IMU, the transformation
between both frames and the clocks' offset are estimated from the flight itself (docs/mocap.md), which must tilt and turn.

examples:
  fbvins mocap take.csv out/flight-orb --body quad
  fbvins mocap take.csv out/flight-orb --expected 0.6,0.3,0 --out measured     the aligned truth as measured/truth_tum.txt
  fbvins mocap take.csv out/flight-orb --start 2:4 --end 28:30                 hovers given by hand, in seconds of the estimate
)";

struct Arguments {
  std::string mocap, estimate, body, out, start, end;
  std::vector<double> expected;
  HandEyeOptions options;
};

/// "2:4", seconds from the estimate's first pose.
Result<std::optional<HoverSpan>> parse_span(const std::string& text, Time from) {
  if (text.empty()) return std::optional<HoverSpan>();
  double a = 0, b = 0;
  char behind = 0;
  if (std::sscanf(text.c_str(), "%lf:%lf%c", &a, &b, &behind) != 2 || !(a < b) || !(std::abs(a) < 1e6) || !(std::abs(b) < 1e6))
    return Error{ErrorCode::invalid_argument, fmt::format("'{}' is no span of seconds such as 2:4", text)};
  return std::optional<HoverSpan>({from + Duration::from_seconds(a), from + Duration::from_seconds(b)});
}

Result<std::optional<AxisErrors>> measure(const Arguments& arguments, const HandEye& found, const Trajectory<W>& estimate) {
  const Trajectory<W> truth = body_truth(found.kept, found.calibration);
  const auto start = parse_span(arguments.start, estimate.front().t), end = parse_span(arguments.end, estimate.front().t);
  if (!start) return start.error();
  if (!end) return end.error();
  const auto hovers = find_hovers(within(truth, estimate));
  if (!hovers && !(*start && *end)) return std::optional<AxisErrors>();
  std::optional<Vec3> expected;
  if (!arguments.expected.empty()) expected = Vec3(arguments.expected[0], arguments.expected[1], arguments.expected[2]);
  const auto errors = axis_errors(truth, estimate, *start ? **start : hovers->first, *end ? **end : hovers->last, expected);
  if (!errors) return errors.error();
  return std::optional<AxisErrors>(*errors);
}

Result<void> write_truth_file(const Trajectory<W>& truth, const std::string& folder) {
  if (Result<void> made = make_folders(folder); !made) return made;
  auto writer = TumWriter::create(folder + "/truth_tum.txt");
  if (!writer) return writer.error();
  for (const StampedPose<W>& pose : truth) writer->write(pose.t, pose.T);
  return writer->close();
}

int run_mocap(const Arguments& arguments) {
  const auto estimate = read_estimate(arguments.estimate);
  if (!estimate) return fail(estimate.error().message);
  const auto markers = read_markers(arguments.mocap, arguments.body);
  if (!markers) return fail(markers.error().message);
  const auto found = align_hand_eye(markers->clean, *estimate, arguments.options);
  if (!found) return fail(fmt::format("{}: {}", arguments.mocap, found.error().message));
  const auto errors = measure(arguments, *found, *estimate);
  if (!errors) return fail(errors.error().message);
  fmt::print("{}", describe(*markers));
  fmt::print("{}", describe(*found, markers->start));
  if (*errors) fmt::print("{}", to_table(**errors, estimate->front().t));
  else fmt::print("no two hovers of a second were found: choose spans with --start and --end\n");
  if (arguments.out.empty()) return kOk;
  const Trajectory<W> truth = within(body_truth(found->kept, found->calibration), *estimate);
  if (Result<void> done = write_truth_file(truth, arguments.out); !done) return fail(done.error().message);
  fmt::print("the IMU's true poses in W, by the estimate's clock: {}/truth_tum.txt\n", arguments.out);
  return kOk;
}

}  // namespace

void add_mocap_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("mocap", kMocapDescription);
  command->footer(kExamples);
  command->add_option("MOCAP_FILE", arguments->mocap, "export of the motion capture")->required();
  command->add_option("ESTIMATE", arguments->estimate, "trajectory file or folder of a run")->required();
  command->add_option("--body", arguments->body, "the rigid body, if there are several");
  command->add_flag("--drift", arguments->options.clock_drift, "estimate the drift of the clocks, too");
  command->add_flag("--level", arguments->options.level_world, "the motion capture's frame is level: estimate its heading only");
  command->add_option("--start", arguments->start,
                      "span from which the flight is measured, in seconds of the estimate, such as 2:4");
  command->add_option("--end", arguments->end, "span to which it is measured");
  command->add_option("--expected", arguments->expected, "expected displacement, m in W: x,y,z")->delimiter(',')->expected(3);
  command->add_option("--out", arguments->out, "folder for the aligned truth");
  command->callback([arguments, &exit_code] { exit_code = run_mocap(*arguments); });
}

}  // namespace fbvins::app
