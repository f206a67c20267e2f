// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "fbvins/io/mcap_recover.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples = R"(examples:
  fbvins record recover flight.mcap -o whole.mcap        a record whose program was killed, with the index that it lacks
)";

struct Arguments {
  std::string file, output;
};

int recover(const Arguments& arguments) {
  const auto done = recover_mcap(arguments.file, arguments.output);
  if (!done) return fail(done.error().message);
  if (done->parts_left_out > 0)
    warn(fmt::format("{} ({} parts of the file are left out)", done->first_damage, done->parts_left_out));
  fmt::print("{}: {} messages{}\n", arguments.output, done->messages,
             done->was_cut_off || done->parts_left_out > 0 ? "" : "; the record was whole already");
  return kOk;
}

}  // namespace

void add_record_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("record", kRecordDescription);
  command->footer(kExamples);
  command->require_subcommand(1);
  CLI::App* again = command->add_subcommand("recover", "write a record again, whole");
  again->footer(kExamples);
  again->add_option("RECORD", arguments->file, "a flight record, or another MCAP file of ROS 2's messages")->required();
  again->add_option("-o,--output", arguments->output, "the file to write, which must not exist")->required();
  again->callback([arguments, &exit_code] { exit_code = recover(*arguments); });
}

}  // namespace fbvins::app
