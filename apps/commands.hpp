// SPDX-License-Identifier: Apache-2.0
// The subcommands of `fbvins`, of whatever program (fbvins.cpp, fbvins_live.cpp, fbvins_tools.cpp,
// fbvins_bags.cpp, fbvins_calibrate.cpp, fbvins_lab.cpp). Each adds itself to the
// command line and, when chosen, sets exit_code.
#pragma once

namespace CLI {
class App;
}

namespace fbvins::app {

/// The program's exit codes.
enum ExitCode : int {
  kOk = 0,
  kEstimationFailed = 1,  ///< the input was fine, but no pose could be estimated
  kSensorsWrong = 1,      ///< doctor, live --check: something is wrong
  kNothingJoined = 1,     ///< map merge --leave-out: no map belongs to the first
  kInterrupted = 130,     ///< calibrate: by a signal, and can go on
  kBadInput = 2,          ///< wrong usage, unreadable file, nothing to compare
};

/// Descriptions of the commands of other programs, for the help of `fbvins`.
inline constexpr const char* kLiveDescription = "estimate the pose from live sensors";
inline constexpr const char* kViewDescription = "show a finished flight in the browser";
inline constexpr const char* kEvalDescription = "compute the errors of a trajectory against the ground truth";
inline constexpr const char* kInfoDescription = "show what is in a recording: rates, gaps, calibration, stamps";
inline constexpr const char* kDoctorDescription = "find what is wrong with a setup: units, axes, clocks, calibration, images";
inline constexpr const char* kBugReportDescription = "gather what helps to find a mistake: versions, options, health, findings";
inline constexpr const char* kMapDescription = "inspect, merge, cut, align, compare and export maps that `run --save-map` wrote";
inline constexpr const char* kPx4Description = "parameters of PX4 for vision: a file to load, and a check";
inline constexpr const char* kRecordDescription = "repair flight records";
inline constexpr const char* kVocabDescription = "train or inspect a vocabulary of visual words";
inline constexpr const char* kFlyDescription = "fly a mission by the odometry's poses, in the simulator";
inline constexpr const char* kBenchDescription = "run recordings x frontends x configurations, make tables";
inline constexpr const char* kTuneDescription = "propose a flight controller's gains from a flight's log";
inline constexpr const char* kConvertDescription = "write a recording as ROS bag, flight record or EuRoC folder";
inline constexpr const char* kSimulateBoardDescription = "render a recording of a calibration board";
inline constexpr const char* kCalibrateDescription = "calibrate cameras and IMU from a recording of a board, or from flights";
inline constexpr const char* kTargetDescription = "make a calibration board to print";
inline constexpr const char* kMocapDescription = "align motion capture with an estimate, measure the flight";

void add_calibrate_command(CLI::App& program, int& exit_code);
void add_target_command(CLI::App& program, int& exit_code);
void add_run_command(CLI::App& program, int& exit_code);
void add_eval_command(CLI::App& program, int& exit_code);
void add_info_command(CLI::App& program, int& exit_code);
void add_doctor_command(CLI::App& program, int& exit_code);
void add_bug_report_command(CLI::App& program, int& exit_code);
void add_convert_command(CLI::App& program, int& exit_code);
void add_config_command(CLI::App& program, int& exit_code);
void add_simulate_command(CLI::App& program, int& exit_code);
void add_report_command(CLI::App& program, int& exit_code);
void add_bench_command(CLI::App& program, int& exit_code);
void add_fly_command(CLI::App& program, int& exit_code);
void add_live_command(CLI::App& program, int& exit_code);
void add_view_command(CLI::App& program, int& exit_code);
void add_map_command(CLI::App& program, int& exit_code);
void add_mocap_command(CLI::App& program, int& exit_code);
void add_tune_command(CLI::App& program, int& exit_code);
void add_px4_command(CLI::App& program, int& exit_code);
void add_record_command(CLI::App& program, int& exit_code);
void add_vocab_command(CLI::App& program, int& exit_code);

}  // namespace fbvins::app
