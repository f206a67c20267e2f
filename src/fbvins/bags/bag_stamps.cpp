// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_stamps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "fbvins/core/median.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

template <class Row>
std::vector<Row> in_recorded_order(const std::vector<Row>& rows, const std::vector<Time>& recorded) {
  std::vector<std::size_t> order(rows.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return recorded[i]; });
  std::vector<Row> out;
  for (const std::size_t i : order) out.push_back(rows[i]);
  return out;
}

/// Whether stamps increase at one rate. A second that a clock ran through twice has stamps between stamps, and one that was set
/// back by more than the recording leaves a gap.
template <class Row>
bool has_one_rate(const std::vector<Row>& rows) {
  constexpr double kShort = 0.4, kFewShort = 0.02, kLongest = 2;
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < rows.size(); ++i) intervals_s.push_back((rows[i].t - rows[i - 1].t).seconds());
  if (intervals_s.empty()) return true;
  const double usual_s = median(intervals_s), count = static_cast<double>(intervals_s.size());
  const auto few = std::ranges::count_if(intervals_s, [&](double s) { return s < kShort * usual_s; });
  return usual_s > 0 && static_cast<double>(few) <= kFewShort * count &&
         (rows.back().t - rows.front().t).seconds() < kLongest * usual_s * count;
}

}  // namespace

void sort_by_recording(BagContents& contents) {
  bool sorted = true, disordered = true;
  const auto check = [&](const auto& rows, const std::vector<Time>& recorded) {
    if (std::ranges::is_sorted(recorded)) return;
    sorted = false;
    disordered = disordered && has_one_rate(in_recorded_order(rows, recorded));
  };
  for (const auto& [name, topic] : contents.imu) check(topic.samples, topic.recorded);
  for (const auto& [name, topic] : contents.images) check(topic.rows, topic.recorded);
  if (sorted || !disordered) return;
  for (auto& [name, topic] : contents.imu) topic.samples = in_recorded_order(topic.samples, topic.recorded);
  for (auto& [name, topic] : contents.images) topic.rows = in_recorded_order(topic.rows, topic.recorded);
  for (auto& [name, topic] : contents.aiding) topic.readings = in_recorded_order(topic.readings, topic.recorded);
}

Result<void> leave_out_zero_stamps(BagContents& contents, const ChosenTopics& topics, std::vector<std::string>& warnings) {
  const auto check = [&](const std::string& topic, auto& rows, const char* what) -> Result<void> {
    const auto zero = std::erase_if(rows, [](const auto& row) { return row.t == Time{}; });
    if (zero == 0) return {};
    if (rows.empty())
      return Error{ErrorCode::malformed, fmt::format("all {} {} on {} have a header stamp of zero: the driver does not stamp; "
                                                     "--recording-time takes the times of recording",
                                                     zero, what, topic)};
    warnings.push_back(
        fmt::format("{} of {} {} on {} have a header stamp of zero and are left out; --recording-time takes "
                    "the times of recording",
                    zero, zero + rows.size(), what, topic));
    return {};
  };
  for (const std::string& topic : topics.cameras)
    if (Result<void> good = check(topic, contents.images.at(topic).rows, "images"); !good) return good;
  for (const std::string& topic : {topics.imu, topics.accel})
    if (const auto imu = contents.imu.find(topic); imu != contents.imu.end())
      if (Result<void> good = check(topic, imu->second.samples, "readings"); !good) return good;
  return {};
}

JoinedClock continue_clock(BagContents& contents, const ChosenTopics& topics) {
  std::vector<StampStream> streams;
  std::vector<std::string> images = topics.cameras, readings;
  if (!topics.depth.empty()) images.push_back(topics.depth);
  for (const std::string& topic : {topics.imu, topics.accel})
    if (!topic.empty()) readings.push_back(topic);
  for (const std::string& topic : images) streams.push_back(stream_of(printable(topic), contents.images.at(topic).rows));
  for (const std::string& topic : readings) streams.push_back(stream_of(printable(topic), contents.imu.at(topic).samples));
  std::vector<StampStream*> all;
  for (StampStream& stream : streams) all.push_back(&stream);
  JoinedClock clock = join_clock(all);
  for (std::size_t i = 0; i < images.size(); ++i) take_clock(streams[i], contents.images.at(images[i]).rows);
  for (std::size_t i = 0; i < readings.size(); ++i) take_clock(streams[images.size() + i], contents.imu.at(readings[i]).samples);
  follow_clock(clock, contents.ground_truth);
  return clock;
}

}  // namespace fbvins
