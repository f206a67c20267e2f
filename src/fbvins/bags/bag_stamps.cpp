// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_stamps.hpp"

#include <fmt/format.h>

#include "fbvins/io/quoted.hpp"

namespace fbvins {

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
