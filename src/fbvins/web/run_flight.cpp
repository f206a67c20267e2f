// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/run_flight.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "fbvins/core/text.hpp"
#include "fbvins/io/csv.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/io/euroc.hpp"
#include "fbvins/io/mcap_dataset.hpp"

namespace fbvins {
namespace {

std::optional<std::string> text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(file), {});
}

/// The rows of a file with a header, by the names of its columns without their units.
class NamedRows {
 public:
  explicit NamedRows(std::string_view text) : lines_(data_lines(text)) {
    std::string_view header = text.substr(0, text.find('\n'));
    if (header.starts_with('#')) header.remove_prefix(1);
    std::vector<std::string_view> names;
    split_at_commas(header, names);
    for (std::size_t i = 0; i < names.size(); ++i) places_[names[i].substr(0, names[i].find(" ["))] = i;
  }

  bool next() {
    if (line_ >= lines_.size()) return false;
    split_at_commas(lines_[line_++].text, fields_);
    return true;
  }
  std::string_view text(std::string_view name) const {
    const auto place = places_.find(name);
    return place != places_.end() && place->second < fields_.size() ? fields_[place->second] : std::string_view();
  }
  template <class Number>
  Number number(std::string_view name) const {
    Number number{};
    const std::string_view field = text(name);
    std::from_chars(field.data(), field.data() + field.size(), number);
    return number;
  }
  double operator()(std::string_view name) const { return number<double>(name); }

 private:
  std::vector<CsvLine> lines_;
  std::map<std::string_view, std::size_t> places_;
  std::vector<std::string_view> fields_;
  std::size_t line_ = 0;
};

Odometry odometry_of(const NamedRows& row, std::int64_t image) {
  Odometry o;
  o.id = FrameId{image};
  o.t = Time{row.number<std::int64_t>("timestamp")};
  o.T_WB.p = {row("p_WB_x"), row("p_WB_y"), row("p_WB_z")};
  o.T_WB.q = Quat(row("q_WB_w"), row("q_WB_x"), row("q_WB_y"), row("q_WB_z"));
  o.v_WB = {row("v_WB_x"), row("v_WB_y"), row("v_WB_z")};
  constexpr const char* kNames[] = {"px", "py", "pz", "tx", "ty", "tz"};
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j)
      o.pose_covariance(i, j) = o.pose_covariance(j, i) = row(fmt::format("cov_{}_{}", kNames[i], kNames[j]));
  o.health = {enumerator_in(row.text("health"), HealthState::lost).value_or(HealthState::initialising),
              enumerator_in(row.text("health_reason"), kLastHealthReason).value_or(HealthReason::none)};
  o.reset_counter = row.number<std::uint32_t>("reset_counter");
  return o;
}

struct RunImage {
  Odometry odometry;
  int features = 0;  ///< tracked and new
};

class RunFlight final : public FinishedFlight {
 public:
  Result<void> read(const std::string& folder) {
    const std::string file = folder + "/trajectory.csv";
    const auto text = text_of(file);
    if (!text)
      return Error{ErrorCode::unreadable,
                   fmt::format("{}: cannot be read: give a folder of fbvins run --out or a flight record", file)};
    for (NamedRows rows(*text); rows.next();) images_.push_back({.odometry = odometry_of(rows, std::ssize(images_))});
    std::erase_if(images_, [](const RunImage& image) { return image.odometry.t.ns <= 0; });
    if (images_.empty()) return Error{ErrorCode::malformed, file + ": contains no poses"};
    read_statistics(folder);
    read_gauge(folder);
    read_summary(folder);
    name = std::filesystem::weakly_canonical(folder).filename().string();
    for (const RunImage& image : images_)
      if (const Odometry& o = image.odometry; o.health.has_pose())
        path.push_back({(o.t - start()).seconds(), o.T_WB.p, o.reset_counter});
    return {};
  }
  Result<void> read_images(const std::string& recording) {
    DatasetOptions options;
    options.require_imu = false;
    auto contents = is_mcap(recording) ? open_mcap(recording, options) : open_euroc(recording, options);
    if (!contents) return contents.error();
    recording_ = *std::move(contents);
    return {};
  }

  // Four events for each image: the image, its features, the pose, the counts so far.
  std::size_t size() const override { return 4 * images_.size(); }
  Time time_of(std::size_t i) const override { return images_[i / 4].odometry.t; }
  bool is_image(std::size_t i) const override { return i % 4 == 0; }
  LiveEvent event(std::size_t i) const override {
    const RunImage& image = images_[i / 4];
    const Odometry& o = image.odometry;
    if (i % 4 == 0) return StereoFrame{o.t, {pixels_at(o.t)}};
    if (i % 4 == 1) return view_of(image);
    if (i % 4 == 2) return o;
    LiveStatus status;
    status.t = o.t;
    status.health = o.health;
    status.reset_counter = o.reset_counter;
    status.counts.images = status.counts.images_estimated = static_cast<std::int64_t>(i / 4) + 1;
    status.counts.resets = o.reset_counter - images_.front().odometry.reset_counter;
    return status;
  }

 private:
  /// Of the features only the number is known.
  static LiveView view_of(const RunImage& image) {
    LiveView view;
    view.t = image.odometry.t;
    view.shutter_to_pose_ms = -1;
    view.features.resize(static_cast<std::size_t>(image.features));
    return view;
  }
  Time start() const { return images_.front().odometry.t; }
  std::map<Time, RunImage*> by_time() {
    std::map<Time, RunImage*> out;
    for (RunImage& image : images_) out[image.odometry.t] = &image;
    return out;
  }

  void read_statistics(const std::string& folder) {
    const auto text = text_of(folder + "/statistics.csv");
    if (!text) return;
    const auto images = by_time();
    for (NamedRows rows(*text); rows.next();) {
      const auto found = images.find(Time{rows.number<std::int64_t>("timestamp")});
      if (found == images.end()) continue;
      found->second->features = rows.number<int>("tracked") + rows.number<int>("detected");
      EstimatorStats& s = found->second->odometry.stats;
      s.frames_in_window = rows.number<int>("window_frames");
      s.landmarks = rows.number<int>("landmarks");
      s.known_landmarks = rows.number<int>("known_landmarks");
      s.observations = rows.number<int>("observations");
      s.outliers = rows.number<int>("outliers");
      s.iterations = rows.number<int>("iterations");
      s.keyframe = rows.number<int>("keyframe") != 0;
    }
  }
  void read_gauge(const std::string& folder) {
    const auto text = text_of(folder + "/gauge.csv");
    if (!text) return;
    const auto images = by_time();
    for (NamedRows rows(*text); rows.next();) {
      const auto found = images.find(Time{rows.number<std::int64_t>("timestamp")});
      if (found == images.end()) continue;
      found->second->odometry.tilt_sigma_rad = rows("tilt_sigma");
      found->second->odometry.level = rows.number<int>("level") != 0;
    }
  }
  void read_summary(const std::string& folder) {
    const auto json = nlohmann::json::parse(text_of(folder + "/summary.json").value_or("{}"), nullptr, false);
    if (json.is_object() && json.contains("result") && json["result"].is_object())
      frontend = json["result"].value("frontend", "");
  }

  std::shared_ptr<const Image> pixels_at(Time t) const {
    if (!recording_) return nullptr;
    const auto& frames = recording_->frames;
    const auto frame =
        std::lower_bound(frames.begin(), frames.end(), t, [](const FrameEntry& f, Time when) { return f.t < when; });
    return frame != frames.end() && frame->t == t ? recording_->loader->load(*frame).frame.left() : nullptr;
  }

  std::vector<RunImage> images_;
  std::optional<DatasetContents> recording_;
};

}  // namespace

Result<std::unique_ptr<FinishedFlight>> open_run_flight(const std::string& folder, const std::string& recording) {
  auto flight = std::make_unique<RunFlight>();
  if (Result<void> read = flight->read(folder); !read) return read.error();
  if (!recording.empty())
    if (Result<void> images = flight->read_images(recording); !images) return images.error();
  return std::unique_ptr<FinishedFlight>(std::move(flight));
}

}  // namespace fbvins
