// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/recorded_flight.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>

#include "fbvins/io/flight_record.hpp"
#include "fbvins/io/mcap_reader.hpp"
#include "fbvins/web/record_messages.hpp"

namespace fbvins {
namespace {

enum class Kind { odometry, image, view, status, mark };

/// An event: a message's place in the file; of odometry only its time.
struct Moment {
  Time t;
  Kind kind;
  std::uint64_t offset = 0, length = 0;
};

std::shared_ptr<const Image> copied(const RosImage& image) {
  if (!image.is_grey() || image.empty()) return nullptr;
  auto out = std::make_shared<Image>(static_cast<int>(image.width), static_cast<int>(image.height));
  for (int y = 0; y < out->height(); ++y)
    std::memcpy(out->row(y), image.pixels.data() + std::size_t{image.step} * static_cast<std::size_t>(y), image.width);
  return out;
}

class RecordedFlight final : public FinishedFlight {
 public:
  explicit RecordedFlight(std::shared_ptr<const ByteSource> bytes) : bytes_(std::move(bytes)) {}

  Result<void> read(const std::string& file) {
    Result<McapReader> reader = McapReader::open(bytes_, file);
    if (!reader) return reader.error();
    while (const auto message = reader->next()) take(*message);
    if (odometry_.empty()) return Error{ErrorCode::unsupported, fmt::format("{}: contains no odometry", file)};
    for (const auto& [t, o] : odometry_) moments_.push_back({t, Kind::odometry});
    // At the same time: the image, then its features, then the pose, then the rest.
    const auto place = [](Kind kind) {
      return kind == Kind::image ? 0 : kind == Kind::view ? 1 : kind == Kind::odometry ? 2 : 3;
    };
    std::stable_sort(moments_.begin(), moments_.end(),
                     [&](const Moment& a, const Moment& b) { return a.t != b.t ? a.t < b.t : place(a.kind) < place(b.kind); });
    for (const auto& [t, o] : odometry_)
      if (o.health.has_pose()) path_of_all(t, o);
    name = std::filesystem::path(file).filename().string();
    return {};
  }

  std::size_t size() const override { return moments_.size(); }
  Time time_of(std::size_t i) const override { return moments_[i].t; }
  bool is_image(std::size_t i) const override { return moments_[i].kind == Kind::image; }
  LiveEvent event(std::size_t i) const override {
    const Moment& moment = moments_[i];
    if (moment.kind == Kind::odometry) return odometry_.at(moment.t);
    const std::string bytes = bytes_->read(moment.offset, moment.length);
    if (moment.kind == Kind::image) {
      const std::optional<RosImage> image = read_image(bytes);
      return StereoFrame{moment.t, {image ? copied(*image) : nullptr}};
    }
    if (moment.kind == Kind::view) return read_view(bytes).value_or(LiveView{});
    if (moment.kind == Kind::mark) return read_mark(bytes).value_or(LiveMark{});
    return status_at(moment.t, bytes);
  }

 private:
  void take(const McapMessage& message) {
    if (message.chunk != 0) return;  // our records are not compressed
    const std::string& topic = message.channel->topic;
    const auto keep = [&](Kind kind) { moments_.push_back({message.log_time, kind, message.offset, message.data.size()}); };
    if (topic == kLeftTopic) keep(Kind::image);
    else if (topic == kLandmarksTopic) keep(Kind::view);
    else if (topic == kMarksTopic) keep(Kind::mark);
    else if (topic == kHealthTopic) take_health(message, keep);
    else if (topic == kOdometryTopic) take_pose(message);
  }

  /// The estimator's health comes before its pose, and alone where there is no pose.
  template <class Keep>
  void take_health(const McapMessage& message, const Keep& keep) {
    const auto diagnostics = read_diagnostics(message.data);
    if (!diagnostics || diagnostics->empty()) return;
    Odometry o;
    o.t = message.log_time;
    if (take_record_health(diagnostics->front(), o)) odometry_[o.t] = o;
    else if (status_of(diagnostics->front())) keep(Kind::status);
  }
  void take_pose(const McapMessage& message) {
    const std::optional<Odometry> pose = read_record_odometry(message.data);
    if (!pose) return;
    Odometry& o = odometry_[pose->t];
    o.t = pose->t;
    o.T_WB = pose->T_WB;
    o.v_WB = pose->v_WB;
    o.w_WB_B = pose->w_WB_B;
    o.pose_covariance = pose->pose_covariance;
  }

  LiveEvent status_at(Time t, const std::string& bytes) const {
    LiveStatus status;
    if (const auto diagnostics = read_diagnostics(bytes); diagnostics && !diagnostics->empty())
      status = status_of(diagnostics->front()).value_or(LiveStatus{});
    status.t = t;
    return status;
  }
  void path_of_all(Time t, const Odometry& o) { path.push_back({(t - moments_.front().t).seconds(), o.T_WB.p, o.reset_counter}); }

  std::shared_ptr<const ByteSource> bytes_;
  std::map<Time, Odometry> odometry_;
  std::vector<Moment> moments_;
};

}  // namespace

Result<std::unique_ptr<FinishedFlight>> open_recorded_flight(const std::string& path) {
  auto bytes = open_bytes(path);
  if (!bytes) return bytes.error();
  auto flight = std::make_unique<RecordedFlight>(*std::move(bytes));
  if (Result<void> read = flight->read(path); !read) return read.error();
  return std::unique_ptr<FinishedFlight>(std::move(flight));
}

}  // namespace fbvins
