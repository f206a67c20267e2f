// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/mcap_dataset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/io/calibration_doubts.hpp"
#include "fbvins/io/dataset_description.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/flight_record.hpp"
#include "fbvins/io/kalibr.hpp"
#include "fbvins/io/kalibr_imu.hpp"
#include "fbvins/io/mcap_images.hpp"
#include "fbvins/io/mcap_reader.hpp"
#include "fbvins/io/recorded_aiding.hpp"
#include "fbvins/io/rig_text.hpp"
#include "fbvins/io/ros_messages.hpp"

namespace fbvins {
namespace {

constexpr double kLargestImuValue = 1e6;          // rad/s or m/s^2: far above the range of any sensor
constexpr Duration kImuLeadIn = {1'000'000'000};  // before the first frame: of use for starting up
// The partner of an image is searched for among this many frames before it.
constexpr std::ptrdiff_t kPairingReach = 8;

/// Whose images a topic has: camera_topic().
std::optional<int> camera_of(std::string_view topic) {
  if (topic == kLeftTopic) return 0;
  if (topic == kRightTopic) return 1;
  constexpr std::string_view kBefore = "/camera/";
  if (topic.size() != kBefore.size() + 1 || !topic.starts_with(kBefore)) return std::nullopt;
  const int camera = topic.back() - '0';
  return camera >= 2 && camera < kMostCameras ? std::optional(camera) : std::nullopt;
}

/// Reads a record step by step; each step leaves its findings in `out`.
class RecordReader {
 public:
  RecordReader(std::shared_ptr<const ByteSource> bytes, McapReader reader, std::string name, const DatasetOptions& options)
      : bytes_(std::move(bytes)), reader_(std::move(reader)), name_(std::move(name)), options_(options) {}

  Result<DatasetContents> read() {
    out_.info.name = std::filesystem::path(name_).stem().string();
    out_.info.format = "MCAP flight record";
    while (const auto message = reader_.next()) take(*message);
    drop_half_frame();
    for (auto step : {&RecordReader::check, &RecordReader::read_calibration})
      if (Result<void> done = (this->*step)(); !done) return done.error();
    out_.aiding = aiding_.readings();
    continue_stamps(out_, name_);
    if (!out_.info.clock_steps.empty()) out_.aiding.clear();
    join_without_trigger();
    if (Result<void> done = cut(); !done) return done.error();
    warn();
    const auto by_time = [](const TrajectoryPoint& a, const TrajectoryPoint& b) { return a.t < b.t; };
    std::stable_sort(out_.ground_truth.begin(), out_.ground_truth.end(), by_time);
    out_.info.ground_truth_poses = static_cast<int>(out_.ground_truth.size());
    describe(out_);
    if (options_.brings_rig() && out_.info.image_rate_hz > 0) out_.rig.image_rate_hz = out_.info.image_rate_hz;
    out_.loader = make_mcap_loader(std::move(bytes_), name_, out_.rig);
    return std::move(out_);
  }

 private:
  void take(const McapMessage& message) {
    const std::string& topic = message.channel->topic;
    ends_with_image_ = false;
    if (topic == kImuTopic) take_imu(message);
    if (topic == kTruthTopic) take_truth(message);
    if (const std::optional<int> camera = camera_of(topic))
      *camera < 2 ? take_image(message, *camera) : take_further(message, *camera);
    if (topic == kDepthTopic) take_depth(message);
    if (!aiding_.take(message)) reader_.complain(message.offset, "this is not a reading of its topic's sensor");
  }

  void take_imu(const McapMessage& message) {
    RowCounts& counts = out_.info.imu_rows;
    ++counts.rows;
    const std::optional<ImuSample> sample = read_imu(message.data);
    if (!sample) {
      ++counts.malformed;
      return reader_.complain(message.offset, "this is not an IMU reading");
    }
    const auto usable = [](const Vec3& v) { return v.allFinite() && v.cwiseAbs().maxCoeff() <= kLargestImuValue; };
    if (!usable(sample->gyro_radps) || !usable(sample->accel_mps2)) {
      ++counts.not_finite;
      return reader_.complain(message.offset, "a value of the IMU is not a usable number");
    }
    out_.imu.push_back(*sample);
  }

  void take_truth(const McapMessage& message) {
    RowCounts& counts = out_.info.ground_truth_rows;
    ++counts.rows;
    const std::optional<RosPose> pose = read_pose(message.data);
    if (!pose || !pose->p.allFinite() || !(std::abs(pose->q.norm() - 1) < 1e-3)) {
      ++counts.malformed;
      return reader_.complain(message.offset, "this is not a pose");
    }
    out_.ground_truth.push_back({pose->t, {pose->q.normalized(), pose->p}, std::nullopt, std::nullopt});
  }

  void take_image(const McapMessage& message, int camera) {
    CameraInfo& info = out_.info.camera(camera);
    ++info.rows.rows;
    const std::optional<RosImage> image = read_image(message.data);
    if (!image || !image->is_grey()) {
      ++info.rows.malformed;
      return reader_.complain(message.offset, image ? "this image is not in 8-bit grey (mono8)" : "this is no image");
    }
    if (image->empty()) {  // marks a frame of which neither camera delivered an image
      out_.frames.push_back({image->t, {}, out_.imu.size()});
      return;
    }
    ++info.listed;
    ends_with_image_ = true;
    FrameEntry& frame = frame_at(image->t, [&](const FrameEntry& f) { return f.file(camera).empty(); });
    frame.file(camera) = mcap_image_name(message.offset, message.data.size());
    frame.imu_before = out_.imu.size();
  }

  /// Of the cameras from number 2 on: the message has the frame's time, the image its own.
  void take_further(const McapMessage& message, int camera) {
    const auto file_of = [&](FrameEntry& frame) -> std::string& { return frame.file(camera); };
    const auto [frame, t] = take_beside(message, out_.info.camera(camera), &RosImage::is_grey, file_of);
    if (frame != nullptr && t != message.log_time) frame->offsets.set(camera, t - message.log_time);
  }
  void take_depth(const McapMessage& message) {
    (void)take_beside(message, out_.info.depth, &RosImage::is_depth, [](FrameEntry& f) -> std::string& { return f.depth_file; });
  }

  /// An image of the frame that has the message's time: that frame and the image's own time; null where it is no such image.
  /// `file_of(frame)`: its place.
  template <class FileOf>
  std::pair<FrameEntry*, Time> take_beside(const McapMessage& message, CameraInfo& camera, bool (RosImage::*is_kind)() const,
                                           FileOf&& file_of) {
    ++camera.rows.rows;
    const std::optional<RosImage> image = read_image(message.data);
    if (!image || !((*image).*is_kind)() || image->empty()) {
      ++camera.rows.malformed;
      reader_.complain(message.offset, "this is no image of its topic's kind");
      return {nullptr, {}};
    }
    ++camera.listed;
    ends_with_image_ = true;
    FrameEntry& frame = frame_at(message.log_time, [&](FrameEntry& f) { return file_of(f).empty(); });
    file_of(frame) = mcap_image_name(message.offset, message.data.size());
    frame.imu_before = out_.imu.size();
    return {&frame, image->t};
  }

  /// A frame of that instant whose place for the image is empty, or a new one.
  template <class IsEmpty>
  FrameEntry& frame_at(Time t, IsEmpty&& is_empty) {
    auto& frames = out_.frames;
    const auto last = frames.rbegin() + std::min(kPairingReach, std::ssize(frames));
    const auto partner = std::find_if(frames.rbegin(), last, [&](FrameEntry& f) { return f.t == t && is_empty(f); });
    return partner != last ? *partner : frames.emplace_back(FrameEntry{t});
  }

  /// Where the file ends after one image of a frame, it is unknown whether there was another: the frame is left out.
  void drop_half_frame() {
    if (!was_cut_off() || !ends_with_image_) return;
    const FrameEntry& last = out_.frames.back();
    const std::optional<Result<StereoRig>> rig = attached_calibration();
    const bool known = rig && *rig;
    bool is_whole = !known || !(*rig)->depth || !last.depth_file.empty();
    for (int i = 0; i < (known ? (*rig)->camera_count() : 2); ++i) is_whole = is_whole && !last.file(i).empty();
    if (!is_whole) out_.frames.pop_back();
  }

  /// The images of cameras without a common trigger, or with time offsets of their own, have stamps of their own: until here each
  /// is a frame.
  void join_without_trigger() {
    const Duration own = own_offsets(out_.rig).of(1);
    std::vector<ImageRow> left, right;
    std::map<Time, const FrameEntry*> recorded;
    for (const FrameEntry& frame : out_.frames) {
      recorded[frame.t] = &frame;
      if (!frame.file(0).empty()) left.push_back({frame.t, frame.file(0)});
      if (!frame.file(1).empty()) right.push_back({frame.t + own, frame.file(1)});
    }
    if (!std::ranges::is_sorted(left, {}, &ImageRow::t) || !std::ranges::is_sorted(right, {}, &ImageRow::t)) return;
    PairedFrames paired = pair_frames(left, right, Duration::from_seconds(1e-3 * options_.pair_tolerance_ms));
    if (!paired.untriggered && own.ns == 0) return;
    for (FrameEntry& frame : paired.frames) {
      auto as_recorded = recorded.extract(frame.t);
      if (as_recorded.empty()) as_recorded = recorded.extract(frame.t - own);
      if (own.ns != 0) frame.offsets.set(1, frame.offsets.of(1) - own);
      if (as_recorded.empty()) continue;
      frame.imu_before = as_recorded.mapped()->imu_before;
      for (int camera = 2; camera < static_cast<int>(as_recorded.mapped()->files.size()); ++camera) {
        frame.file(camera) = as_recorded.mapped()->file(camera);
        frame.offsets.set(camera, as_recorded.mapped()->offsets.of(camera));
      }
    }
    for (const auto& [t, frame] : recorded)
      if (frame->file(0).empty() && frame->file(1).empty()) paired.frames.push_back(*frame);
    std::ranges::stable_sort(paired.frames, {}, &FrameEntry::t);
    if (paired.untriggered) out_.info.warnings.push_back(untriggered_sentence(paired.frames, 1, options_.pair_tolerance_ms));
    out_.frames = std::move(paired.frames);
  }

  /// Its writer was: what is finished has a summary.
  bool was_cut_off() const { return reader_.damage().ends_early || reader_.damage().no_summary; }

  Result<void> check() {
    const char* lack = nullptr;
    if (out_.info.camera(0).listed + out_.info.camera(1).listed == 0) lack = "holds no images, so the flight cannot be run again";
    else if (out_.imu.empty() && options_.require_imu) lack = "holds no IMU readings";
    if (!lack) return {};
    if (reader_.damage().parts > 0) return Error{ErrorCode::malformed, reader_.damage().first};
    return Error{ErrorCode::unsupported, fmt::format("{}: {}", name_, lack)};
  }

  Result<void> read_calibration() {
    if (options_.rig) return out_.rig = *options_.rig, Result<void>{};
    if (!options_.kalibr_camchain.empty()) return read_kalibr_calibration();
    std::optional<Result<StereoRig>> rig = attached_calibration();
    if (!rig) return Error{ErrorCode::malformed, fmt::format("{}: holds no calibration, and none is given with it", name_)};
    if (!*rig) return rig->error();
    out_.rig = **rig;
    if (options_.kalibr_imu.empty()) return {};
    const Result<StereoRig> given = with_imu_file(out_.rig, options_.kalibr_imu);
    if (!given) return given.error();
    out_.rig = *given;
    return {};
  }

  /// Without Kalibr's file of the IMU, its noise is that of the record.
  Result<void> read_kalibr_calibration() {
    const auto& imu = options_.kalibr_imu;
    const std::optional<Result<StereoRig>> own = attached_calibration();
    Result<StereoRig> rig = load_kalibr(options_.kalibr_camchain, imu.empty() ? std::nullopt : std::optional(imu),
                                        own && *own ? (*own)->imu_noise : ImuNoise{});
    if (!rig) return rig.error();
    out_.rig = *rig;
    for (std::string& doubt : chain_doubts(options_.kalibr_camchain)) out_.info.warnings.push_back(std::move(doubt));
    if (!imu.empty() || (own && *own)) return {};
    const std::string why = own ? own->error().message : fmt::format("{}: holds no calibration", name_);
    out_.info.warnings.push_back(fmt::format("{}; IMU noise figures are the defaults", why));
    return {};
  }

  std::optional<Result<StereoRig>> attached_calibration() const {
    for (const McapAttachment& attachment : reader_.attachments())
      if (attachment.name == kCalibrationAttachment)
        return parse_rig(attachment.data, fmt::format("{}: {}", name_, attachment.name));
    return std::nullopt;
  }

  Result<void> cut() {
    if (Result<void> cut = cut_frames(options_, out_.frames); !cut)
      return Error{cut.error().code, fmt::format("{}: {}", name_, cut.error().message)};
    if (begins_later(options_)) cut_lead_in();
    return {};
  }

  void cut_lead_in() {
    const Time start = out_.frames.front().t + Duration::from_seconds(out_.rig.time_offset_s) - kImuLeadIn;
    const auto first = std::find_if(out_.imu.begin(), out_.imu.end(), [&](const ImuSample& s) { return s.t >= start; });
    const auto cut = static_cast<std::size_t>(first - out_.imu.begin());
    out_.imu.erase(out_.imu.begin(), first);
    std::erase_if(out_.aiding, [&](const AidingSample& r) { return stamp_of(r) < start; });
    for (FrameEntry& frame : out_.frames) *frame.imu_before -= std::min(cut, *frame.imu_before);
  }

  void warn() {
    const McapDamage& damage = reader_.damage();
    DatasetInfo& info = out_.info;
    for (const FrameEntry& frame : out_.frames) {
      if (!out_.rig.has_right()) break;
      info.camera(0).unpaired += !frame.file(0).empty() && frame.file(1).empty();
      info.camera(1).unpaired += !frame.file(1).empty() && frame.file(0).empty();
    }
    if (damage.parts > 0)
      info.warnings.push_back(fmt::format("{} ({} parts of the file are left out)", damage.first, damage.parts));
    if (was_cut_off())
      info.warnings.push_back(fmt::format("{}: was cut off while it was written; all up to byte {} is read", name_, damage.end));
    if (const int left = info.camera(0).unpaired, right = info.camera(1).unpaired; left + right > 0)
      info.warnings.push_back(fmt::format("{} left and {} right images have no partner of the same stamp", left, right));
  }

  std::shared_ptr<const ByteSource> bytes_;
  McapReader reader_;
  std::string name_;
  const DatasetOptions& options_;
  RecordedAiding aiding_;
  bool ends_with_image_ = false;
  DatasetContents out_;
};

}  // namespace

bool is_mcap(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return false;
  const auto bytes = open_bytes(path);
  return path.ends_with(".mcap") || (bytes && (*bytes)->read(0, kMcapMagic.size()) == kMcapMagic);
}

Result<DatasetContents> open_mcap(const std::string& path, const DatasetOptions& options) {
  const auto bytes = open_bytes(path);
  if (!bytes) return bytes.error();
  return read_mcap(*bytes, path, options);
}

Result<DatasetContents> read_mcap(std::shared_ptr<const ByteSource> bytes, const std::string& name,
                                  const DatasetOptions& options) {
  Result<McapReader> reader = McapReader::open(bytes, name);
  if (!reader) return reader.error();
  return RecordReader(std::move(bytes), *std::move(reader), name, options).read();
}

Result<std::string> recorded_configuration(const std::string& path) {
  const auto bytes = open_bytes(path);
  if (!bytes) return bytes.error();
  Result<McapReader> reader = McapReader::open(*bytes, path);
  if (!reader) return reader.error();
  (void)reader->next();  // attachments are before the first message
  for (const McapAttachment& attachment : reader->attachments())
    if (attachment.name == kConfigurationAttachment) return attachment.data;
  return Error{ErrorCode::malformed, fmt::format("{}: holds no configuration", path)};
}

Trajectory<W> recorded_odometry(const std::string& path) {
  Trajectory<W> out;
  const auto bytes = is_mcap(path) ? open_bytes(path) : Error{ErrorCode::not_found, path};
  if (!bytes) return out;
  Result<McapReader> reader = McapReader::open(*bytes, path);
  if (!reader) return out;
  while (const auto message = reader->next()) {
    if (message->channel->topic != kOdometryTopic) continue;
    const std::optional<RosPose> pose = read_odometry(message->data);
    if (pose && pose->p.allFinite() && std::abs(pose->q.norm() - 1) < 1e-3)
      out.push_back({pose->t, {pose->q.normalized(), pose->p}});
  }
  return out;
}

}  // namespace fbvins
