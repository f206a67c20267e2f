// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/recording.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "fbvins/bags/bag_aiding.hpp"
#include "fbvins/bags/bag_contents.hpp"
#include "fbvins/bags/bag_loader.hpp"
#include "fbvins/bags/bag_stamps.hpp"
#include "fbvins/bags/calibration.hpp"
#include "fbvins/bags/given_calibration.hpp"
#include "fbvins/bags/rectified_images.hpp"
#include "fbvins/bags/topic_choice.hpp"
#include "fbvins/camera/camera_times.hpp"
#include "fbvins/camera/check_rig.hpp"
#include "fbvins/core/byte_source.hpp"
#include "fbvins/core/options.hpp"
#include "fbvins/io/calibration_doubts.hpp"
#include "fbvins/io/camera_order.hpp"
#include "fbvins/io/dataset_description.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/flight_record.hpp"
#include "fbvins/io/image_check.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/kalibr_imu.hpp"
#include "fbvins/io/mcap_dataset.hpp"
#include "fbvins/io/mcap_reader.hpp"
#include "fbvins/io/no_overlap.hpp"
#include "fbvins/io/side_by_side.hpp"

namespace fbvins {
namespace {

namespace fs = std::filesystem;

// IMU samples this long before the first frame delivered are of use for starting up.
constexpr Duration kImuLeadIn = {1'000'000'000};
// Messages are recorded later than they are stamped, some of them by seconds.
constexpr Duration kRecordingDelay = {2'000'000'000};
constexpr Duration kForever = {std::int64_t{1} << 62};

/// Makes a recording of a bag step by step.
class BagRecording {
 public:
  BagRecording(std::string path, const RecordingOptions& options, std::optional<StereoRig> rig)
      : path_(std::move(path)), options_(options), rig_(std::move(rig)) {
    if (!options_.calibration.empty() && is_kalibr(options_.calibration)) rostopics_ = rostopics_of(options_.calibration);
  }

  Result<DatasetContents> read(std::unique_ptr<BagReader> bag) {
    const DatasetOptions& o = options_.dataset;
    if (o.start_s > 0 || o.duration_s > 0) {
      const Duration start = Duration::from_seconds(o.start_s), end = start + Duration::from_seconds(o.duration_s);
      bag->only(start - kImuLeadIn - kRecordingDelay, o.duration_s > 0 ? end + kRecordingDelay : kForever);
    }
    contents_ = read_contents(*bag, {}, options_.by_recording);
    bag_ = bag.get();
    for (auto step :
         {&BagRecording::choose, &BagRecording::check_stamps, &BagRecording::continue_stamps, &BagRecording::split_images,
          &BagRecording::calibrate, &BagRecording::use_depths, &BagRecording::join, &BagRecording::cut})
      if (Result<void> done = (this->*step)(); !done)
        return Error{done.error().code, fmt::format("{}: {}", path_, done.error().message)};
    describe_bag(*bag);
    make_loader(std::move(bag));
    if (of_camera_info_ && topics_.depth.empty() && !side_by_side_)
      judge_rectified(contents_, topics_, options_.calibration, out_);
    return std::move(out_);
  }

 private:
  Result<void> choose() {
    const std::string& camera = options_.dataset.camera;
    const WantedTopics wanted{options_.dataset.require_imu, camera == "depth", camera == "all" || camera == "depth",
                              rig_ ? rig_->camera_count() : kMostCameras};
    const Result<ChosenTopics> chosen = choose_topics(contents_, options_.topics, wanted);
    if (!chosen) return chosen.error();
    topics_ = *chosen;
    named_ = std::ranges::any_of(options_.topics, [&](const std::string& t) { return contents_.images.contains(t); });
    return {};
  }

  Result<void> check_stamps() { return leave_out_zero_stamps(contents_, topics_, out_.info.warnings); }

  Result<void> continue_stamps() {
    JoinedClock clock = continue_clock(contents_, topics_);
    for (std::string& sentence : clock.said) out_.info.warnings.push_back(fmt::format("{}: {}", path_, sentence));
    out_.info.clock_steps = std::move(clock.begins);
    return {};
  }

  /// One topic of images that are twice as wide as those of a calibration of two cameras has both side by side.
  Result<void> split_images() {
    if (!rig_ || rig_->camera_count() != 2 || topics_.cameras.size() != 1 || !topics_.depth.empty()) return {};
    const std::string topic = topics_.cameras.front();
    const ImageTopic& images = contents_.images.at(topic);
    if (images.rows.empty()) return {};
    const auto first = image_of(bag_->read(place_of(images.rows.front().file)), images.encoding, images.compressed);
    if (!first || !is_side_by_side(first->width(), first->height(), *rig_)) return {};
    side_by_side_ = true;
    topics_.cameras.push_back(topic);
    out_.info.warnings.push_back(
        fmt::format("the images on {} are two side by side: the left half is camera 0, the right one camera 1", topic));
    return {};
  }

  Result<void> calibrate() {
    if (const auto own = own_rig(contents_, topics_); !rig_ && own && options_.calibration.empty()) {
      if (!*own) return own->error();
      rig_ = **own;
      whole_calibration_ = true;
    }
    if (!rig_) {
      if (!named_) topics_.cameras = calibrated_cameras(contents_, topics_);
      if (!options_.calibration.empty())
        if (Result<void> taken = take_camera_info(options_.calibration, topics_, contents_); !taken) return taken;
      const Result<StereoRig> rig = rig_of(contents_, topics_, options_.calibration);
      if (!rig) return rig.error();
      rig_ = *rig;
      out_.info.warnings.emplace_back("the bag has no noise figures of the IMU: defaults are used");
      of_camera_info_ = true;
    }
    if (const std::string& imu = options_.dataset.kalibr_imu; !imu.empty()) {
      const Result<StereoRig> given = with_imu_file(*rig_, imu);
      if (!given) return given.error();
      rig_ = *given;
    }
    if (std::cmp_greater(topics_.cameras.size(), rig_->camera_count()))
      return Error{ErrorCode::invalid_argument, fmt::format("images of {} cameras are to be used, and the calibration has {}",
                                                            topics_.cameras.size(), rig_->camera_count())};
    if (const auto order = order_by_topics(rostopics_, topics_.cameras); !order.empty()) {
      rig_ = in_order(*rig_, order);
      out_.info.warnings.push_back(order_sentence(options_.calibration, order));
    }
    if (!options_.calibration.empty())
      for (std::string& doubt : chain_doubts(options_.calibration)) out_.info.warnings.push_back(std::move(doubt));
    std::vector<MountedCamera> cameras;
    for (std::size_t i = 0; i < topics_.cameras.size(); ++i) cameras.push_back(rig_->mounted(static_cast<int>(i)));
    out_.rig = *rig_;
    out_.rig.depth.reset();
    out_.rig = with_cameras(out_.rig, cameras);
    return {};
  }

  /// Depth images that do not lie on the camera's are used with the pose that calibration or bag have of the sensor; without one
  /// they are an error only where they were asked for.
  Result<void> use_depths() {
    if (topics_.depth.empty()) return {};
    DepthSensor sensor = rig_->depth.value_or(DepthSensor{});
    const std::string why = sensor.own ? "" : not_registered(contents_, topics_);
    if (!why.empty()) sensor.own = depth_camera_of(contents_, topics_, out_.rig);
    if (!why.empty() && !sensor.own) {
      const std::string sentence = fmt::format("the depth images on {} are not registered to {}, and their pose is not known: {}",
                                               topics_.depth, topics_.cameras.front(), why);
      if (options_.dataset.camera == "depth" || named_) return Error{ErrorCode::unsupported, sentence};
      out_.info.warnings.push_back(sentence + "; they are not used");
      topics_.depth.clear();
      return {};
    }
    if (!rig_->depth) out_.info.warnings.emplace_back("there are no figures of the depth sensor: defaults are used");
    out_.rig = with_depth(out_.rig, sensor);
    return check_rig(out_.rig, topics_.depth);
  }

  std::vector<ImageRow> rows_of(const std::string& name, CameraInfo& info) {
    ImageTopic& topic = contents_.images.at(name);
    info.rows.malformed += topic.malformed;
    info.rows.rows += topic.malformed;
    std::vector<ImageRow> rows = in_order(side_by_side_ ? topic.rows : std::move(topic.rows), info.rows);
    info.listed += static_cast<int>(rows.size());
    return rows;
  }

  Result<void> join() {
    DatasetInfo& info = out_.info;
    std::vector<std::vector<ImageRow>> cameras;
    for (std::size_t i = 0; i < topics_.cameras.size(); ++i)
      cameras.push_back(rows_of(topics_.cameras[i], info.camera(static_cast<int>(i))));
    const std::vector<ImageRow> depths = topics_.depth.empty() ? std::vector<ImageRow>{} : rows_of(topics_.depth, info.depth);
    const double tolerance_ms = options_.dataset.pair_tolerance_ms;
    out_.frames = join_images(std::move(cameras), depths, own_offsets(out_.rig), tolerance_ms, info);
    const auto never = [&](const std::string& topic) {
      return Error{ErrorCode::malformed,
                   fmt::format("no stamp on {} lies within {} ms of one on {}", topic, tolerance_ms, topics_.cameras.front())};
    };
    if (topics_.cameras.size() > 1 && info.cameras[0].unpaired == info.cameras[0].listed) return never(topics_.cameras[1]);
    if (info.depth.listed > 0 && info.depth.unpaired == info.depth.listed) return never(topics_.depth);
    if (Result<void> read = read_imu(); !read) return read;
    return read_aiding(contents_, topics_, out_);
  }

  Result<void> read_imu() {
    if (topics_.imu.empty()) return {};
    RowCounts& counts = out_.info.imu_rows;
    out_.imu = readings_on(contents_, topics_.imu, topics_.accel, counts);
    const std::string shared = shared_stamps(counts.rows, counts.duplicates);
    if (2 * counts.duplicates > counts.rows)
      return Error{ErrorCode::malformed, fmt::format("{}: of {} readings {}", topics_.imu, counts.rows, shared)};
    if (!shared.empty()) out_.info.warnings.push_back(fmt::format("{}: {}", topics_.imu, shared));
    return {};
  }

  Result<void> cut() {
    const DatasetOptions& o = options_.dataset;
    auto& frames = out_.frames;
    if (Result<void> cut = cut_frames(o, frames); !cut) return cut;
    const Duration offset = Duration::from_seconds(out_.rig.time_offset_s);
    const Time first = frames.front().t + offset, last = frames.back().t + offset;
    if (!out_.imu.empty() && (out_.imu.back().t < first || out_.imu.front().t > last))
      return no_overlap(topics_.imu, {out_.imu.front().t, out_.imu.back().t}, {first, last}, is_part(o));
    if (begins_later(o)) std::erase_if(out_.imu, [&](const ImuSample& s) { return s.t < first - kImuLeadIn; });
    if (begins_later(o)) std::erase_if(out_.aiding, [&](const AidingSample& r) { return stamp_of(r) < first - kImuLeadIn; });
    return {};
  }

  void describe_bag(const BagReader& bag) {
    DatasetInfo& info = out_.info;
    info.name = fs::path(path_).lexically_normal().stem().string();
    info.format = fmt::format("{}: {}, {}", bag.format(), fmt::join(topics_.cameras, ", "), topics_.imu);
    if (!topics_.accel.empty()) info.format += fmt::format(" with {}", topics_.accel);
    if (!topics_.depth.empty()) info.format += fmt::format(", depth images {}", topics_.depth);
    const BagDamage& damage = bag.damage();
    if (damage.parts > 0)
      info.warnings.push_back(fmt::format("{} ({} parts of the file are left out)", damage.first, damage.parts));
    if (damage.ends_early) info.warnings.push_back(fmt::format("{}: was cut off; all that is whole is read", path_));
    RowCounts truth;
    out_.ground_truth = in_order(std::move(contents_.ground_truth), truth);
    info.ground_truth_poses = static_cast<int>(out_.ground_truth.size());
    describe(out_);
    constexpr double kSameRate = 0.05;  // few calibrations say the cameras' rate: then it is measured
    if (std::abs(out_.rig.image_rate_hz - info.image_rate_hz) > kSameRate * info.image_rate_hz)
      out_.rig.image_rate_hz = info.image_rate_hz;
    if (info.imu_rate_hz > 0 && options_.calibration.empty() && !whole_calibration_)
      out_.rig.imu_noise.rate_hz = info.imu_rate_hz;
  }

  void make_loader(std::unique_ptr<BagReader> bag) {
    const auto sensor = [&](const std::string& topic, const Camera& camera) {
      const ImageTopic& images = contents_.images.at(topic);
      return BagLoader::Sensor{camera, images.encoding, images.compressed};
    };
    std::vector<BagLoader::Sensor> cameras;
    for (const std::string& topic : topics_.cameras) {
      cameras.push_back(sensor(topic, out_.rig.camera(static_cast<int>(cameras.size()))));
      if (side_by_side_) cameras.back().part = cameras.size() == 1 ? BagLoader::Sensor::left_half : BagLoader::Sensor::right_half;
    }
    std::optional<BagLoader::Sensor> depth;
    if (!topics_.depth.empty()) depth = sensor(topics_.depth, out_.rig.depth_camera());
    auto loader = std::make_unique<BagLoader>(std::move(bag), path_, std::move(cameras), std::move(depth));
    if (const int bits = loader->find_used_bits(out_.frames); bits < 16)
      out_.info.warnings.push_back(used_bits_sentence(path_, bits));
    out_.loader = std::move(loader);
  }

  std::string path_;
  const RecordingOptions& options_;
  std::optional<StereoRig> rig_;
  std::vector<std::string> rostopics_;  ///< of the cameras of a Kalibr chain that is given; empty without
  BagContents contents_;
  ChosenTopics topics_;
  BagReader* bag_ = nullptr;        ///< while it is read
  bool side_by_side_ = false;       ///< the one topic of images has those of both cameras
  bool named_ = false;              ///< topics of images are given, and not found
  bool whole_calibration_ = false;  ///< the bag's own, noise and rates included
  bool of_camera_info_ = false;     ///< the calibration
  DatasetContents out_;
};

/// A flight record of ours carries its calibration.
bool is_flight_record(const std::string& path) {
  const auto bytes = open_bytes(path);
  if (!bytes) return false;
  auto reader = McapReader::open(*bytes, path);
  if (!reader) return false;
  (void)reader->next();  // attachments are before the first message
  return std::any_of(reader->attachments().begin(), reader->attachments().end(),
                     [](const McapAttachment& a) { return a.name == kCalibrationAttachment; });
}

}  // namespace

bool is_bag(const std::string& path) {
  std::error_code ignored;
  const fs::path p(path);
  if (fs::is_directory(p, ignored)) {
    if (fs::exists(p / "metadata.yaml", ignored)) return true;
    for (const auto& entry : fs::directory_iterator(p, ignored))
      if (entry.path().extension() == ".db3" || (entry.path().extension() == ".mcap" && !is_flight_record(entry.path().string())))
        return true;
    return false;
  }
  if (p.extension() == ".db3" || is_ros1_bag(path)) return true;
  return is_mcap(path) && !is_flight_record(path);
}

Result<std::unique_ptr<Dataset>> open_recording(const std::string& path, const RecordingOptions& given) {
  RecordingOptions options = given;
  if (Result<void> valid = validate(options.dataset); !valid) return valid.error();
  std::error_code ignored;
  const bool bag = is_bag(path);
  if (!bag && fs::is_directory(path, ignored)) find_tum_vi(path, options);
  if (bag && !options.imu_calibration.empty()) choose_imu(path, options);
  if (Result<void> taken = take_calibration(bag, options); !taken) return taken.error();
  if (!bag) return open_dataset(path, options.dataset);
  auto reader = open_bag(path);
  if (!reader) return reader.error();
  Result<DatasetContents> contents = BagRecording(path, options, options.dataset.rig).read(*std::move(reader));
  if (!contents) return contents.error();
  if (const auto scaled = options.dataset.scale_lenses ? scaled_to_images(*contents) : std::nullopt) {
    auto again = open_bag(path);
    if (!again) return again.error();
    contents = BagRecording(path, options, scaled->rig).read(*std::move(again));
    if (!contents) return contents.error();
    contents->info.scaled = scaled->cameras;
  }
  if (Result<void> readable = check_images(*contents); !readable) return readable.error();
  if (options.dataset.camera == "depth" && !contents->rig.depth) return no_depth_images(path);
  return std::make_unique<Dataset>(*std::move(contents), options.dataset);
}

}  // namespace fbvins
