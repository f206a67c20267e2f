// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/bag_aiding.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fbvins/io/aiding_messages.hpp"
#include "fbvins/io/quoted.hpp"

namespace fbvins {
namespace {

Result<std::vector<AidingSample>> aiding_on(const BagContents& contents, const std::string& name, const std::string& imu) {
  const AidingTopic& topic = contents.aiding.at(name);
  std::vector<AidingSample> out = topic.readings;
  if (out.empty() || !mounting_of(out.front())) return out;
  const auto of_imu = contents.imu.find(imu);
  const std::string body = of_imu == contents.imu.end() ? std::string() : of_imu->second.frame;
  const auto T_BS = find_transform(contents.transforms, body, topic.frame);
  if (!T_BS)
    return Error{
        ErrorCode::not_found,
        fmt::format("the place of the sensor of {} is not known: no transform on /tf_static takes '{}' to the IMU's '{}'",
                    printable(name), printable(topic.frame), printable(body))};
  for (AidingSample& reading : out) reading = mounted(reading, *T_BS);
  return out;
}

}  // namespace

Result<void> read_aiding(const BagContents& contents, const ChosenTopics& topics, DatasetContents& out) {
  DatasetInfo& info = out.info;
  for (const auto& [topic, readings] : contents.aiding)
    if (std::ranges::find(topics.aiding, topic) == topics.aiding.end() && !readings.readings.empty())
      info.warnings.push_back(fmt::format("the readings on {} are not used unless --topics names it", printable(topic)));
  for (const std::string& topic : topics.aiding) {
    if (!info.clock_steps.empty()) {
      info.warnings.push_back(fmt::format("the readings on {} are not used: the clock of the bag steps back", printable(topic)));
      continue;
    }
    const auto readings = aiding_on(contents, topic, topics.imu);
    if (!readings) return readings.error();
    if (const int malformed = contents.aiding.at(topic).malformed; malformed > 0)
      info.warnings.push_back(fmt::format("{}: {} readings that cannot be are left out", printable(topic), malformed));
    out.aiding.insert(out.aiding.end(), readings->begin(), readings->end());
  }
  std::ranges::stable_sort(out.aiding, {}, [](const AidingSample& r) { return stamp_of(r); });
  return {};
}

}  // namespace fbvins
