// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/euroc.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/camera/check_rig.hpp"
#include "fbvins/io/aiding_folders.hpp"
#include "fbvins/io/calibration.hpp"
#include "fbvins/io/calibration_doubts.hpp"
#include "fbvins/io/calibration_fields.hpp"
#include "fbvins/io/camera_order.hpp"
#include "fbvins/io/dataset_description.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/euroc_root.hpp"
#include "fbvins/io/euroc_rows.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/kalibr.hpp"
#include "fbvins/io/kalibr_imu.hpp"
#include "fbvins/io/no_overlap.hpp"
#include "fbvins/io/side_by_side.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestTruth_bytes = std::uint64_t{1} << 30u, kLargestBeside_bytes = std::uint64_t{1} << 28u;
// IMU samples this long before the first frame delivered are of use for starting up.
constexpr Duration kImuLeadIn = {1'000'000'000};

/// Opens one recording step by step; each step leaves its findings in `out`.
class EurocReader {
 public:
  EurocReader(std::unique_ptr<FileSource> files, std::string root, const DatasetOptions& options)
      : files_(std::move(files)), root_(std::move(root)), options_(options) {}

  Result<DatasetContents> read(const std::string& path) {
    out_.info.name = dataset_name(path);
    out_.info.format = files_->packed() ? "EuRoC zip" : "EuRoC folder";
    find_cameras();
    for (auto step : {&EurocReader::read_calibration, &EurocReader::read_depth_sensor, &EurocReader::read_rows,
                      &EurocReader::read_frames, &EurocReader::read_imu, &EurocReader::read_aiding})
      if (Result<void> done = (this->*step)(); !done) return done.error();
    read_ground_truth();
    describe_frames();
    out_.loader = make_euroc_loader(std::move(files_), root_, folders(), out_.rig, out_.frames, out_.info);
    return std::move(out_);
  }

 private:
  std::string named(const std::string& file) const { return files_->describe(root_ + file); }
  bool exists(const std::string& file) const { return files_->exists(root_ + file); }
  Result<std::string> text(const std::string& file, std::uint64_t max_bytes) const {
    return files_->read(root_ + file, max_bytes);
  }
  void warn(std::string sentence) { out_.info.warnings.push_back(std::move(sentence)); }

  static std::string depth(const char* file) { return std::string(kDepthFolder) + file; }
  static std::string folder_of(int camera) { return fmt::format("cam{}/", camera); }
  std::vector<std::string> folders() const {
    std::vector<std::string> out;
    for (const int camera : cameras_) out.push_back(folder_of(camera));
    return out;
  }

  /// The cameras whose folders are there, whichever. A further one that nobody has calibrated, a colour camera, is left out.
  void find_cameras() {
    for (int i = 0; i < kMostCameras; ++i) {
      const bool images = exists(folder_of(i) + "data.csv"), calibration = exists(folder_of(i) + "sensor.yaml");
      if (i < 2 ? images || calibration : images && (calibration || options_.brings_rig())) cameras_.push_back(i);
    }
    if (cameras_.empty()) cameras_ = {0};
    std::string renumbered;
    for (std::size_t i = 0; i < cameras_.size(); ++i)
      if (cameras_.size() > 1 && cameras_[i] != static_cast<int>(i))
        renumbered += fmt::format(", cam{} is camera {}", cameras_[i], i);
    if (!renumbered.empty()) warn(fmt::format("cameras are numbered as they come{}", renumbered));
    // Two cameras see depths themselves: depth images are for one.
    const bool wanted = options_.camera == "depth" || (options_.camera == "all" && cameras_.size() == 1);
    has_depth_ = wanted && cameras_.front() == 0 && exists(depth("data.csv")) && exists(depth("sensor.yaml"));
    if (has_depth_) cameras_.resize(1);
  }

  template <class Parser>
  auto parse_yaml(const std::string& file, Parser parser) const -> decltype(parser(std::declval<YamlReader>())) {
    Result<std::string> yaml = text(file, kLargestYaml_bytes);
    if (!yaml) return yaml.error();
    return parser({named(file), *std::move(yaml)});
  }

  Result<void> read_calibration() {
    // Recordings without IMU have no imu0, those calibrated from outside may lack its sensor.yaml.
    if (options_.rig) return take(*options_.rig), Result<void>{};
    ImuSensor imu;
    if (exists("imu0/sensor.yaml") || (options_.kalibr_camchain.empty() && options_.require_imu)) {
      Result<ImuSensor> read = parse_yaml("imu0/sensor.yaml", parse_euroc_imu);
      if (!read) return read.error();
      imu = *read;
    } else if (options_.kalibr_imu.empty()) {
      warn(fmt::format("{}: no such file; IMU noise figures are the defaults", named("imu0/sensor.yaml")));
    }
    T_BI_ = imu.T_BS;
    return options_.kalibr_camchain.empty() ? read_own_calibration(imu) : read_kalibr_calibration(imu);
  }

  Result<void> read_depth_sensor() {
    if (!has_depth_) return {};
    Result<DepthSensor> sensor =
        parse_yaml(depth("sensor.yaml"), [&](YamlReader yaml) { return parse_depth_sensor(std::move(yaml), T_BI_); });
    if (!sensor) return sensor.error();
    out_.rig = with_depth(out_.rig, *sensor);
    return check_rig(out_.rig, named(depth("sensor.yaml")));
  }

  Result<void> read_own_calibration(const ImuSensor& imu) {
    std::vector<CameraSensor> cameras;
    for (const std::string& folder : folders()) {
      const ReadBeside beside = [&](const std::string& name) { return text(folder + name, kLargestMask_bytes); };
      Result<CameraSensor> read =
          parse_yaml(folder + "sensor.yaml", [&](YamlReader yaml) { return parse_euroc_camera(std::move(yaml), beside); });
      if (!read) return read.error();
      cameras.push_back(*read);
    }
    Result<StereoRig> rig = join_euroc(cameras, imu, named(folders().back() + "sensor.yaml"));
    if (rig && !options_.kalibr_imu.empty()) rig = with_imu_file(*rig, options_.kalibr_imu);
    if (!rig) return rig.error();
    out_.rig = *rig;
    if (cameras_.size() == 2 && !exists(folder_of(cameras_[1]) + "data.csv")) split_images(*rig);
    return {};
  }

  /// The only camera's images may be those of both cameras of the calibration, side by side.
  bool split_images(const StereoRig& rig) {
    const std::string folder = folder_of(cameras_.front());
    const Result<std::string> csv = text(folder + "data.csv", kLargestBeside_bytes);
    if (rig.camera_count() != 2 || !csv) return false;
    const auto images = read_image_rows(*csv, named(folder + "data.csv"));
    if (!images || images->rows.empty()) return false;
    const Result<std::string> bytes = text(folder + "data/" + images->rows.front().file, kLargestBeside_bytes);
    const Result<Image> first = bytes ? decode_image(*bytes) : Result<Image>(bytes.error());
    if (!first || !is_side_by_side(first->width(), first->height(), rig)) return false;
    cameras_ = {cameras_.front(), cameras_.front()};
    warn(fmt::format("the images of {} are two side by side: the left half is camera 0, the right one camera 1", named(folder)));
    return true;
  }

  Result<void> read_kalibr_calibration(const ImuSensor& imu) {
    const auto& path = options_.kalibr_imu;
    Result<StereoRig> rig = load_kalibr(options_.kalibr_camchain, path.empty() ? std::nullopt : std::optional(path), imu.noise);
    if (!rig) return rig.error();
    for (std::string& doubt : chain_doubts(options_.kalibr_camchain)) warn(std::move(doubt));
    const std::vector<std::string> rostopics = rostopics_of(options_.kalibr_camchain);
    std::vector<std::string> folders;
    for (int i = 0; i < rig->camera_count(); ++i) folders.push_back(fmt::format("cam{}", i));
    if (rig->camera_count() == 1 && !rostopics.empty()) take_only(rostopics.front());
    if (const auto order = order_by_topics(rostopics, folders); !order.empty()) {
      warn(order_sentence(options_.kalibr_camchain, order));
      rig = in_order(*rig, order);
    }
    take(*rig);
    return {};
  }

  /// A calibration of one camera that names another folder than the first is that one's.
  void take_only(const std::string& rostopic) {
    const auto named = [&](int camera) { return names_camera(rostopic, fmt::format("cam{}", camera)); };
    const auto found = std::ranges::find_if(cameras_, named);
    if (found == cameras_.end() || found == cameras_.begin()) return;
    cameras_ = {*found};
    warn(
        fmt::format("{}: its camera is cam{} by its rostopic, which is flown alone", options_.kalibr_camchain, cameras_.front()));
  }

  /// A calibration from outside, whose cameras have the numbers of the folders; one of a single camera is that of the first
  /// folder. Cameras that were not recorded, and folders without a calibration, are left out.
  void take(const StereoRig& rig) {
    if (cameras_.size() == 1 && split_images(rig)) {
      out_.rig = rig;
      return;
    }
    if (rig.camera_count() == 1) cameras_.resize(1);
    else std::erase_if(cameras_, [&](int camera) { return camera >= rig.camera_count(); });
    std::vector<MountedCamera> mounted;
    for (const int camera : cameras_) mounted.push_back(rig.mounted(rig.camera_count() == 1 ? 0 : camera));
    out_.rig = with_cameras(rig, mounted);
  }

  Result<void> read_rows() {
    has_imu_ = options_.require_imu || exists("imu0/data.csv");
    Result<EurocRows> rows = read_euroc_rows(*files_, root_, {folders(), has_depth_ ? std::string(kDepthFolder) : "", has_imu_});
    if (!rows) return rows.error();
    rows_ = *std::move(rows);
    out_.info.clock_steps = rows_.clock.begins;
    for (std::string& warning : rows_.warnings) warn(std::move(warning));
    return {};
  }

  Result<void> read_frames() {
    std::vector<std::vector<ImageRow>> lists;
    DatasetInfo& info = out_.info;
    for (std::size_t i = 0; i < cameras_.size(); ++i) lists.push_back(taken(rows_.cameras[i], info.camera(static_cast<int>(i))));
    const std::vector<ImageRow> depths = taken(rows_.depth, info.depth);
    out_.frames = join_images(std::move(lists), depths, own_offsets(out_.rig), options_.pair_tolerance_ms, info);
    const auto never = [&](const std::string& folder) {
      return Error{ErrorCode::malformed, fmt::format("{}: no stamp lies within {} ms of one of cam{}'s",
                                                     named(folder + "data.csv"), options_.pair_tolerance_ms, cameras_[0])};
    };
    if (cameras_.size() > 1 && info.cameras[0].unpaired == info.cameras[0].listed) return never(folder_of(cameras_[1]));
    if (info.depth.listed > 0 && info.depth.unpaired == info.depth.listed) return never(std::string(kDepthFolder));
    if (Result<void> cut = cut_frames(options_, out_.frames); !cut)
      return Error{cut.error().code, fmt::format("{}: {}", named(folders().front() + "data.csv"), cut.error().message)};
    return find_images();
  }

  static std::vector<ImageRow> taken(StampedRows<ImageRow>& rows, CameraInfo& info) {
    info.rows += rows.counts;
    info.listed += static_cast<int>(rows.rows.size());
    return std::move(rows.rows);
  }

  /// Drops names of missing files, and frames of which both files are missing.
  Result<void> find_images() {
    std::string first_missing;
    const auto look = [&](std::string& file, const std::string& folder, ImageCounts& counts) {
      if (file.empty() || exists(folder + file)) return;
      if (first_missing.empty()) first_missing = named(folder + file);
      ++counts.missing;
      file.clear();
    };
    for (FrameEntry& frame : out_.frames) {
      const std::vector<std::string> in = folders();
      for (int i = 0; i < static_cast<int>(in.size()); ++i)
        look(frame.file(i), in[static_cast<std::size_t>(i)] + "data/", out_.info.camera(i).images);
      look(frame.depth_file, depth("data/"), out_.info.depth.images);
    }
    const std::size_t emptied = std::erase_if(out_.frames, [](const FrameEntry& f) { return f.without_images(); });
    out_.info.frames_without_image = static_cast<int>(emptied);
    if (out_.frames.empty())
      return Error{ErrorCode::not_found, fmt::format("{}: no such file, nor any other of the images listed", first_missing)};
    int missing = out_.info.depth.images.missing;
    for (const CameraInfo& camera : out_.info.cameras) missing += camera.images.missing;
    if (missing > 0) warn(fmt::format("{}: no such file; {} of the images listed are missing", first_missing, missing));
    return {};
  }

  Result<void> read_imu() {
    if (!has_imu_) return {};
    out_.info.imu_rows = rows_.imu.counts;
    out_.imu = std::move(rows_.imu.rows);
    return check_overlap();
  }

  Result<void> check_overlap() {
    const Duration offset = Duration::from_seconds(out_.rig.time_offset_s);
    const Time first = out_.frames.front().t + offset, last = out_.frames.back().t + offset;
    if (out_.imu.back().t < first || out_.imu.front().t > last)
      return no_overlap(named("imu0/data.csv"), {out_.imu.front().t, out_.imu.back().t}, {first, last}, is_part(options_));
    if (begins_later(options_)) std::erase_if(out_.imu, [&](const ImuSample& s) { return s.t < first - kImuLeadIn; });
    return {};
  }

  /// Of all aiding sensors there are, in order of stamps.
  Result<void> read_aiding() {
    for (const AidingFolder& kind : aiding_folders())
      for (int i = 0; i < kMostAiding; ++i) {
        const std::string folder = fmt::format("{}{}/", kind.name, i);
        if (!exists(folder + "data.csv")) continue;
        if (Result<void> done = read_sensor(kind, folder); !done) return done;
      }
    std::ranges::stable_sort(out_.aiding, {}, [](const AidingSample& r) { return stamp_of(r); });
    const Time first = out_.frames.front().t + Duration::from_seconds(out_.rig.time_offset_s);
    if (begins_later(options_))
      std::erase_if(out_.aiding, [&](const AidingSample& r) { return stamp_of(r) < first - kImuLeadIn; });
    return {};
  }

  Result<void> read_sensor(const AidingFolder& kind, const std::string& folder) {
    if (!rows_.clock.begins.empty())
      return warn(fmt::format("{}: not used: the clock of the recording steps back", named(folder + "data.csv"))), Result<void>{};
    Result<std::string> csv = text(folder + "data.csv", kLargestBeside_bytes);
    if (!csv) return csv.error();
    Result<std::vector<AidingSample>> readings = parse_yaml(folder + "sensor.yaml", [&](YamlReader yaml) {
      return kind.parse({std::move(yaml), *csv, named(folder + "data.csv"), T_BI_}, out_.info.warnings);
    });
    if (!readings) return readings.error();
    out_.aiding.insert(out_.aiding.end(), readings->begin(), readings->end());
    return {};
  }

  /// Needed for evaluation only: where it cannot be used, a warning is enough.
  void read_ground_truth() {
    const std::string folder = "state_groundtruth_estimate0/";
    if (!exists(folder + "data.csv")) return;
    Pose<B, B> T_BS;
    if (exists(folder + "sensor.yaml")) {
      Result<Pose<B, B>> mounting = parse_yaml(folder + "sensor.yaml", parse_euroc_mounting);
      if (!mounting) return warn(fmt::format("ground truth is not used: {}", mounting.error().message));
      T_BS = *mounting;
    }
    Result<std::string> csv = text(folder + "data.csv", kLargestTruth_bytes);
    if (!csv) return warn(fmt::format("ground truth is not used: {}", csv.error().message));
    Result<TrajectoryFile> truth = parse_truth(*csv, named(folder + "data.csv"), rows_.clock);
    if (!truth) return warn(fmt::format("ground truth is not used: {}", truth.error().message));
    for (std::string& warning : row_warnings(truth->counts, named(folder + "data.csv"))) warn(std::move(warning));
    out_.info.ground_truth_rows = truth->counts;
    out_.info.ground_truth_poses = static_cast<int>(truth->points.size());
    out_.ground_truth = std::move(truth->points);
    refer_to_imu(out_.ground_truth, T_BS.inverse() * T_BI_);
  }

  void describe_frames() {
    describe(out_);
    if (options_.brings_rig() && out_.info.image_rate_hz > 0) out_.rig.image_rate_hz = out_.info.image_rate_hz;
  }

  std::unique_ptr<FileSource> files_;
  std::string root_;
  const DatasetOptions& options_;
  std::vector<int> cameras_;  ///< numbers of the folders: of the left camera, the right one, and those that follow
  bool has_depth_ = false;    ///< images of a depth sensor, which are used
  bool has_imu_ = false;
  EurocRows rows_;
  Pose<B, B> T_BI_;  ///< takes IMU to the recording's body coordinates
  DatasetContents out_;
};

}  // namespace

Result<DatasetContents> open_euroc(const std::string& path, const DatasetOptions& options) {
  Result<std::unique_ptr<FileSource>> files = open_file_source(path);
  if (!files) return files.error();
  Result<std::string> root = find_root(**files, path);
  if (!root) return root.error();
  return EurocReader(*std::move(files), *root, options).read(path);
}

}  // namespace fbvins
