// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "apps/commands.hpp"
#include "apps/evaluation_report.hpp"
#include "apps/mocap_report.hpp"
#include "apps/open_recording.hpp"
#include "apps/terminal.hpp"
#include "fbvins/eval/misreading.hpp"
#include "fbvins/io/dataset.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kExamples =
    R"(GROUND_TRUTH is a trajectory file (TUM's, EuRoC's, those of VINS-Mono, VINS-Fusion, ORB-SLAM3 and OpenVINS, a CSV whose header
names the columns, as `rostopic echo -p` and ulog2csv write it, positions alone), a recording with
ground truth, of which the share of images with a pose is printed as well, or a bag with a topic of PoseStamped,
TransformStamped or Odometry; ESTIMATE is a trajectory file or such a bag. The stamps of both are matched as by evo:
the nearest, at most --max-diff apart.

examples:
  fbvins eval MH_01_easy out/MH_01_easy-boost/trajectory_tum.txt
  fbvins eval groundtruth.csv estimate.txt --align sim3 --json
  fbvins eval groundtruth.csv estimate.txt --align yaw --interpolate
  fbvins eval flight.bag estimate.txt --topic /vicon/quad/pose
  fbvins eval take.csv estimate.txt --hand-eye
)";

struct Arguments {
  std::string truth, estimate, format, alignment = "se3", pairs = "all", path = "truth", topic;
  double max_difference_s = 0.01;
  bool interpolate = false, json = false, hand_eye = false;
};

struct Truth {
  Trajectory<W> poses;
  std::vector<Time> images;  ///< empty when the truth came from a file
};

/// A ROS 2 bag can be a folder, too.
bool is_euroc(const std::string& path) {
  if (path.ends_with(".zip")) return true;
  return std::filesystem::is_directory(path) && !std::filesystem::exists(path + "/metadata.yaml");
}

Result<Truth> read_truth(const std::string& path, const std::string& topic) {
  if (!is_euroc(path)) {
    auto poses = open_poses(path, topic);
    if (!poses) return poses.error();
    return Truth{std::move(*poses), {}};
  }
  DatasetOptions options;
  options.prefetch_frames = 0;
  options.require_imu = false;
  const auto data = open_dataset(path, options);
  if (!data) return data.error();
  if (!(*data)->has_ground_truth()) return Error{ErrorCode::not_found, path + ": the recording holds no ground truth"};
  Truth truth;
  for (const TrajectoryPoint& point : (*data)->ground_truth()) truth.poses.push_back({point.t, point.T_WB});
  for (const FrameEntry& frame : (*data)->frames()) truth.images.push_back(frame.t);
  return truth;
}

/// Motion capture, aligned with the estimate: the IMU's poses by the estimate's clock.
Result<Truth> read_markers_as_truth(const std::string& path, const Trajectory<W>& estimate) {
  const auto markers = read_markers(path, "");
  if (!markers) return markers.error();
  const auto found = align_hand_eye(markers->clean, estimate, {});
  if (!found) return Error{found.error().code, fmt::format("{}: {}", path, found.error().message)};
  return Truth{body_truth(found->kept, found->calibration), {}};
}

EvaluationOptions options_of(const Arguments& arguments) {
  EvaluationOptions options;
  options.alignment = *alignment_from_string(arguments.alignment);
  options.association.max_difference_s = arguments.max_difference_s;
  if (arguments.interpolate) options.association.method = AssociationMethod::interpolate_truth;
  for (RelativeErrorOptions* relative : {&options.per_metre, &options.per_second}) {
    relative->all_pairs = arguments.pairs == "all";
    relative->path_of_truth = arguments.path == "truth";
  }
  return options;
}

int evaluate_files(const Arguments& arguments) {
  const Result<TrajectoryFormat> format = parse_trajectory_format(arguments.format);
  if (!format) return fail("--format: " + format.error().message);
  const auto estimate =
      arguments.format.empty() ? open_poses(arguments.estimate, "") : read_pose_file(arguments.estimate, *format);
  if (!estimate) return fail(estimate.error().message);
  const auto truth =
      arguments.hand_eye ? read_markers_as_truth(arguments.truth, *estimate) : read_truth(arguments.truth, arguments.topic);
  if (!truth) return fail(truth.error().message);
  EvaluationOptions options = options_of(arguments);
  for (const auto& [poses, of] : {std::pair(&truth->poses, &arguments.truth), {&*estimate, &arguments.estimate}})
    if (!has_orientations(*poses)) {
      options.orientations = false;
      note(fmt::format("{}: positions without orientations, which are not compared", *of));
    }
  const Misreading misread = find_misreading(truth->poses, *estimate, options.association);
  if (!misread.said.empty())
    note(fmt::format("{}: {}, as the truth shows; the file is read accordingly", arguments.estimate, misread.said));
  const auto evaluation = evaluate(truth->poses, misread.estimate, options);
  if (!evaluation) return fail(evaluation.error().message);
  std::optional<Coverage> coverage;
  if (!truth->images.empty()) {
    std::vector<Time> stamps;
    for (const StampedPose<W>& pose : *estimate) stamps.push_back(pose.t);
    coverage = coverage_of(truth->images, std::move(stamps));
  }
  if (arguments.json) {
    Json json = to_json(*evaluation, options.alignment);
    json["found_by_truth"] = misread.said;
    if (coverage) json["coverage"] = to_json(*coverage);
    fmt::print("{}\n", json.dump(2));
    return kOk;
  }
  fmt::print("{}", to_table(*evaluation, options.alignment));
  if (coverage) fmt::print("{}", to_line(*coverage));
  return kOk;
}

}  // namespace

void add_eval_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("eval", kEvalDescription);
  command->footer(kExamples);
  command->add_option("GROUND_TRUTH", arguments->truth, "trajectory file or recording")->required();
  command->add_option("ESTIMATE", arguments->estimate, "trajectory file")->required();
  command->add_option("--topic", arguments->topic, "topic of poses, if GROUND_TRUTH is a bag with several");
  command->add_option("--format", arguments->format,
                      "how ESTIMATE is written, where that is found wrongly: ns, us, ms or s, and wxyz or xyzw, such as us,wxyz");
  command->add_option("--align", arguments->alignment, "alignment of the estimate with the truth, before errors are computed")
      ->check(CLI::IsMember({"se3", "yaw", "sim3", "none"}))
      ->capture_default_str();
  command->add_option("--max-diff", arguments->max_difference_s, "largest difference of matched stamps, s")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--interpolate", arguments->interpolate, "interpolate the truth at the estimate's stamps instead");
  command->add_flag("--hand-eye", arguments->hand_eye,
                    "GROUND_TRUTH is motion capture: align it with the estimate first (fbvins mocap)");
  command->add_option("--pairs", arguments->pairs, "segments for the relative error: all, overlapping, or consecutive ones")
      ->check(CLI::IsMember({"all", "consecutive"}))
      ->capture_default_str();
  command->add_option("--path", arguments->path, "whose path is measured for segments of a metre")
      ->check(CLI::IsMember({"truth", "estimate"}))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments, &exit_code] { exit_code = evaluate_files(*arguments); });
}

}  // namespace fbvins::app
