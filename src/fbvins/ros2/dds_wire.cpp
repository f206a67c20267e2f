// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/dds_wire.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "fbvins/ros2/cdr_type.hpp"

namespace fbvins {
namespace {

constexpr dds_duration_t kMaxBlocking = DDS_MSECS(100);

/// ROS's hashes of these definitions (REP 2016), which nodes since Iron compare.
struct TypeHash {
  std::string_view type, hash;
};
constexpr TypeHash kTypeHashes[] = {
    {"nav_msgs/msg/Odometry", "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    {"nav_msgs/msg/Path", "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b"},
    {"tf2_msgs/msg/TFMessage", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
    {"diagnostic_msgs/msg/DiagnosticArray", "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
    {"sensor_msgs/msg/CameraInfo", "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"},
    {"sensor_msgs/msg/Image", "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
    {"sensor_msgs/msg/Imu", "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"},
    {"sensor_msgs/msg/PointCloud2", "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"},
    {"rmw_dds_common/msg/ParticipantEntitiesInfo", "91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"}};

}  // namespace

Error dds_failure(std::string_view what, dds_return_t code) {
  return Error{ErrorCode::unwritable, fmt::format("{}: {}", what, dds_strretcode(code))};
}

std::string wire_type(const std::string& type) {
  const auto first = type.find('/'), last = type.rfind('/');
  return fmt::format("{}::{}::dds_::{}_", type.substr(0, first), type.substr(first + 1, last - first - 1), type.substr(last + 1));
}

std::string wire_topic(const std::string& topic) { return "rt" + topic; }

Qos make_qos(const Ros2Quality& quality, const std::string& type) {
  Qos qos(dds_create_qos());
  const auto* const known = std::ranges::find(kTypeHashes, type, &TypeHash::type);
  if (known != std::end(kTypeHashes)) {
    const std::string told = fmt::format("typehash=RIHS01_{};", known->hash);
    dds_qset_userdata(qos.get(), told.data(), told.size());
  }
  dds_qset_reliability(qos.get(), quality.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, kMaxBlocking);
  dds_qset_durability(qos.get(), quality.latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, quality.depth);
  return qos;
}

Result<TopicOfBytes> make_wire_topic(dds_entity_t participant, const std::string& topic, const std::string& type) {
  ddsi_sertype* bytes = make_cdr_type(wire_type(type));
  const dds_entity_t made = dds_create_topic_sertype(participant, topic.c_str(), &bytes, nullptr, nullptr, nullptr);
  if (made >= 0) return TopicOfBytes{DdsEntity(made), bytes};
  ddsi_sertype_unref(bytes);
  return dds_failure("ROS 2 topic " + topic, made);
}

Result<void> write_bytes(dds_entity_t writer, const ddsi_sertype& type, std::string message, std::string_view name) {
  const dds_return_t code = dds_writecdr(writer, make_cdr_message(type, std::move(message)));
  if (code == DDS_RETCODE_OK || code == DDS_RETCODE_TIMEOUT) return {};  // a reader that does not read is no error
  return dds_failure(name, code);
}

}  // namespace fbvins
