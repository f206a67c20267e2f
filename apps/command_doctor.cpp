// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "apps/commands.hpp"
#include "apps/evaluation_report.hpp"
#include "apps/open_recording.hpp"
#include "apps/terminal.hpp"
#include "fbvins/doctor/doctor.hpp"
#include "fbvins/doctor/gather.hpp"
#include "fbvins/io/output_file.hpp"
#include "fbvins/io/png_encode.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(Finds what is wrong with a setup: units, signs and axes of the IMU, its time offset and rotation to the cameras, the
calibration between the cameras, and the images themselves. Each finding says what was measured with its standard deviation,
what it should be, what to do, and gives the corrected line of the calibration. The last lines say what was judged and what was not.
The first 40 s of motion are used; a recording shows most if the rig is rotated and moved about all axes.

examples:
  fbvins doctor MH_01_easy
  fbvins doctor flight --calibration camchain-imucam.yaml
  fbvins doctor flight.mcap --all                all measurements, right or wrong
  fbvins doctor flight --json
  fbvins doctor flight --out masks               writes mask0.png, mask1.png of what is fixed in view, if anything is

exit codes: 0 nothing wrong in what was judged, 1 something is wrong, 2 wrong usage or bad input
)";

struct Arguments {
  RecordingArguments recording;
  std::string out;
  bool all = false, json = false;
};

Json to_json(const Diagnosis& diagnosis) {
  Json findings = Json::array();
  for (const Finding& f : diagnosis.findings)
    findings.push_back({{"kind", std::string(to_string(f.kind))},
                        {"size", f.size},
                        {"sigma", f.sigma},
                        {"unit", f.unit},
                        {"measured", f.measured},
                        {"expected", f.expected},
                        {"advice", f.advice},
                        {"corrected", f.corrected}});
  return Json{{"findings", findings}, {"measured", diagnosis.measured}, {"not_judged", diagnosis.not_judged}};
}

/// mask0.png, mask1.png: of the cameras in which something is fixed in view.
Result<void> write_masks(const Diagnosis& diagnosis, const std::string& folder) {
  for (std::size_t i = 0; i < diagnosis.masks.size(); ++i) {
    if (!diagnosis.masks[i]) continue;
    std::error_code ignored;  // then the file cannot be written
    std::filesystem::create_directories(folder, ignored);
    Result<OutputFile> file = OutputFile::create(fmt::format("{}/mask{}.png", folder, i));
    if (!file) return file.error();
    file->write(encode_png(diagnosis.masks[i]->image()));
    if (Result<void> done = file->close(); !done) return done;
  }
  return {};
}

int examine_recording(const Arguments& arguments) {
  const auto data = open_recording(arguments.recording, {});
  if (!data) return fail(data.error().message);
  RecordingWarnings warnings;
  warnings.print((*data)->info());
  if (!(*data)->rig().has_right())
    return fail(fmt::format("{}: has one camera; the doctor judges a pair", arguments.recording.path));
  EvidenceGatherer gatherer((*data)->rig());
  while (auto event = (*data)->next())
    if (!gatherer.push(*event)) break;
  warnings.print_at_end((*data)->info());
  const bool kalibr = !arguments.recording.calibration.empty();
  const Diagnosis diagnosis = examine(gatherer.finish(), kalibr ? CalibrationStyle::kalibr : CalibrationStyle::euroc);
  if (!arguments.out.empty())
    if (Result<void> written = write_masks(diagnosis, arguments.out); !written) return fail(written.error().message);
  if (arguments.json) {
    fmt::print("{}\n", to_json(diagnosis).dump(2));
  } else {
    fmt::print("{}\n", to_text(diagnosis, arguments.all));
  }
  return diagnosis.findings.empty() ? kOk : kSensorsWrong;
}

}  // namespace

void add_doctor_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("doctor", kDoctorDescription);
  command->footer(kExamples);
  arguments->recording.add_to(*command);
  command->add_option("--out", arguments->out, "folder for the masks of what is fixed in view: mask0.png, mask1.png");
  command->add_flag("--all", arguments->all, "print all measurements, too");
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments, &exit_code] { exit_code = examine_recording(*arguments); });
}

}  // namespace fbvins::app
