// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "apps/commands.hpp"
#include "apps/progress.hpp"
#include "apps/simulated_boards.hpp"
#include "apps/terminal.hpp"
#include "fbvins/calibration/calibration_files.hpp"
#include "fbvins/config/option_fields.hpp"
#include "fbvins/config/yaml.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/core/options.hpp"
#include "fbvins/sim/euroc_writer.hpp"
#include "fbvins/sim/sensor_kits.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kSimulateExamples =
    R"(Writes a EuRoC folder with images, IMU and exact truth, and simulation.yaml (the effective options).
The same options and seed give the same bytes.

examples:
  fbvins simulate --out flight                      30 s of the preset 'normal'
  fbvins simulate fast --seed 7 --seconds 60 --out fast7
  fbvins simulate normal --set camera.line_delay_us=30 --set world.kind=hall --out rolling
  fbvins simulate --trajectory MH_01.csv --imu imu0.csv --out again     a real flight and its real IMU
  fbvins simulate handheld --sensors l515 --out l515    cameras and IMU that people have; truth.yaml is their true calibration
  fbvins simulate board --out board                 a calibration board instead of a flight (docs/calibration.md)
  fbvins simulate dim --options > dim.yaml          every option of a preset with unit, range and meaning
)";

struct SimulateArguments {
  std::string preset = "normal", sensors, config, out, trajectory, imu;
  std::vector<std::string> assignments;
  int seed = -1, max_images = 0, tags = 0;
  double seconds = 0;
  bool options = false, depth = false, landmarks = false, quiet = false;
};

Result<SimulationOptions> options_of(const SimulateArguments& arguments) {
  Result<SimulationOptions> options = simulation_preset(arguments.preset);
  if (!options) return options;
  if (!arguments.sensors.empty())
    if (Result<void> used = use_sensors(*options, arguments.sensors); !used) return used.error();
  const std::vector<OptionField> fields = fields_of(*options);
  if (!arguments.config.empty())
    if (Result<void> read = read_yaml_file(arguments.config, fields); !read) return read.error();
  if (arguments.seed >= 0) options->seed = arguments.seed;
  if (arguments.seconds > 0) options->flight.duration_s = arguments.seconds;
  else if (!arguments.trajectory.empty()) options->flight.duration_s = 3600;
  if (!arguments.trajectory.empty()) options->recorded.trajectory = arguments.trajectory;
  if (!arguments.imu.empty()) options->recorded.imu = arguments.imu;
  for (const std::string& assignment : arguments.assignments)
    if (Result<void> set = set_option(fields, assignment); !set) return set.error();
  if (Result<void> valid = validate(*options); !valid) return valid.error();
  return *options;
}

Result<void> write_options(SimulationOptions options, const std::string& folder) {
  return write_file_atomically(folder + "/simulation.yaml", write_yaml(fields_of(options)));
}

/// The true calibration, in Kalibr's form. Biases change with time: they are in the ground truth, with the poses.
Result<void> write_true_calibration(const Simulation& simulation, const std::string& folder) {
  StereoRig rig = simulation.rig;
  rig.imu_noise.axes.gyro = simulation.imu.gyro_axes, rig.imu_noise.axes.accel = simulation.imu.accel_axes;
  return write_file_atomically(folder + "/truth.yaml", to_kalibr_rig(rig_calibration(rig)));
}

int simulate_flight(const SimulateArguments& arguments) {
  Result<SimulationOptions> options = options_of(arguments);
  if (!options) return fail(options.error().message);
  if (arguments.options) {
    fmt::print("{}", write_yaml(fields_of(*options)));
    return kOk;
  }
  if (arguments.out.empty()) return fail("--out FOLDER is needed");
  Result<std::string> tags = std::string();
  Result<Simulation> simulation = prepare_simulation(*options, [&](World& world, const Simulation& s) {
    if (arguments.tags > 0) tags = hang_simulated_tags(world, s, arguments.tags);
  });
  if (!simulation) return fail(simulation.error().message);
  if (!tags) return fail(tags.error().message);

  const EurocWriterOptions writer{arguments.depth, arguments.landmarks, arguments.max_images};
  Progress progress(static_cast<int>(simulation->frames.size()), arguments.quiet);
  const Result<void> written = write_euroc(*simulation, arguments.out, writer, [&](int done, int) { progress.update(done); });
  if (!written) return fail(written.error().message);
  if (arguments.tags > 0)
    if (Result<void> saved = write_file_atomically(arguments.out + "/tags.yaml", *tags); !saved)
      return fail(saved.error().message);
  if (options->sensors != "none")
    if (Result<void> saved = write_true_calibration(*simulation, arguments.out); !saved) return fail(saved.error().message);
  if (Result<void> saved = write_options(*options, arguments.out); !saved) return fail(saved.error().message);
  if (!arguments.quiet)
    fmt::print("{} frames, {} IMU samples in {}\n", simulation->frames.size(), simulation->imu.samples.size(),
               bold(arguments.out));
  return kOk;
}

}  // namespace

void add_simulate_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command = program.add_subcommand("simulate", "render a synthetic recording with exact truth");
  command->footer(kSimulateExamples);
  command->add_option("PRESET", arguments->preset, "light, texture, motion or place (default normal)")
      ->check(CLI::IsMember(simulation_presets()));
  command->add_option("--sensors", arguments->sensors, "cameras and IMU that people have (docs/simulator.md)")
      ->check(CLI::IsMember(sensor_kits()));
  command->add_option("--out", arguments->out, "folder for the recording");
  command->add_option("--seed", arguments->seed, "seed of world, flight and noise")->check(CLI::NonNegativeNumber);
  command->add_option("--seconds", arguments->seconds, "length of the flight")->check(CLI::PositiveNumber);
  command->add_option("--config", arguments->config, "YAML file that changes the preset");
  command->add_option("--set", arguments->assignments, "one option, name=value; may be repeated")
      ->take_all()
      ->allow_extra_args(false);
  command->add_option("--trajectory", arguments->trajectory, "fly along a recorded trajectory (TUM or EuRoC)");
  command->add_option("--imu", arguments->imu, "with --trajectory: its real IMU readings, used unchanged (EuRoC CSV)");
  command->add_option("--max-images", arguments->max_images, "stop after this many stereo images, 0 for all")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--tags", arguments->tags, "hang so many AprilTags of 0.2 m on walls, their poses in tags.yaml (docs/maps.md)")
      ->check(CLI::Range(0, 100));
  command->add_flag("--depth", arguments->depth, "write left depth images in millimetres, too");
  command->add_flag("--landmarks", arguments->landmarks, "write the corners of the world's surfaces, too");
  command->add_flag("--options", arguments->options, "print the effective options and stop");
  command->add_flag("--quiet", arguments->quiet, "print nothing but errors and warnings");
  add_simulate_board_command(*command, exit_code);
  command->callback([arguments, command, &exit_code] {
    if (command->get_subcommands().empty()) exit_code = simulate_flight(*arguments);
  });
}

}  // namespace fbvins::app
