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
    {"lifecycle_msgs/msg/TransitionEvent", "d5f8873a2f0146498f812d7885c7327ce27e463d36811d8792f35ee38c0d6c38"},
    {"std_srvs/srv/Trigger_Request", "d010825374ce8918e72bfd826c82603e60f45419e932ea976f807b74a863a199"},
    {"std_srvs/srv/Trigger_Response", "2d946c21e2fc3f1e9ca6986a8191d85fcc70097a8bb7771a053564bc47009cdf"},
    {"rcl_interfaces/srv/ListParameters_Request", "a1b0b5d6b967a5b8ac5bc8563c3ea678f349e312a6a4967227c5a96bc5ce38df"},
    {"rcl_interfaces/srv/ListParameters_Response", "31b937b82de3612426be79f231e386259f97e8dc843e3f2845288b4bfa296bdd"},
    {"rcl_interfaces/srv/GetParameters_Request", "135a9e1c3d7cebef792f6687d7ddf99949b21a0bd9a320d863a9110a3f5cf4d6"},
    {"rcl_interfaces/srv/GetParameters_Response", "9fa773b46e39cc5d02db6224d8fd520bb9caeeffc2b27c96c1e59431baba9f2a"},
    {"rcl_interfaces/srv/GetParameterTypes_Request", "87d7ec5ef545d4daa289d500025d31fb2437bc8b8365ca367161c4dac4be33fd"},
    {"rcl_interfaces/srv/GetParameterTypes_Response", "ac1335dce67c478e669434f6ac2fbff34fcd529580f272d3006785ba8b54e47f"},
    {"rcl_interfaces/srv/DescribeParameters_Request", "05dd1c2bc87dec2627105c8070d6f9725c781a4f2ab852975bf105462b82b644"},
    {"rcl_interfaces/srv/DescribeParameters_Response", "ad6747319613c6131589e062e095b469a46cc764f7d0f12a001a49e6cd893995"},
    {"rcl_interfaces/srv/SetParameters_Request", "130d46386b7e84ea9ecf60608a4d83cbe5e5cb7c6cc5b712b7a4e3a6c254e932"},
    {"rcl_interfaces/srv/SetParameters_Response", "7a0e8140a0b8d98308fa81a5403a766e610af29a239caf54b7553227906fc266"},
    {"rcl_interfaces/srv/SetParametersAtomically_Request", "db0bd950ed5ed867a0e90b225e44dea382d762c0762ff3e0ee842190042a59e5"},
    {"rcl_interfaces/srv/SetParametersAtomically_Response", "31b1a38c5b0b9d893ee24da45f69638f4561c78461d82d52750f429b534502b8"},
    {"lifecycle_msgs/srv/GetState_Request", "77a9c844e7975f15bc2221e8bbebafc4d118afb78c7f7071eef91f83f940f2f6"},
    {"lifecycle_msgs/srv/GetState_Response", "fe249babab472e42cb5653b5d6a6b0c42a003b0fdfb84851aea3fde08760b4f5"},
    {"lifecycle_msgs/srv/ChangeState_Request", "d74c6f524e14cade7b67e7297190360ed749264af300524fc1456f27cc2a553a"},
    {"lifecycle_msgs/srv/ChangeState_Response", "e1ddfed0271fefe63767aa71561926e4d9eac0f1ddf9e71a8873eb46b36deac2"},
    {"lifecycle_msgs/srv/GetAvailableTransitions_Request", "52a73c0b5d7489bee0df6ddb0aec45c41289d223ff225b58fe11d859ac8109a6"},
    {"lifecycle_msgs/srv/GetAvailableTransitions_Response", "4711339461aadf02bcfff797a198de911f885074bd3f2fe9f7b677ef87f0741c"},
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

Qos make_qos(const Ros2Quality& quality, const std::string& type, const std::string& more) {
  Qos qos(dds_create_qos());
  std::string told = more;
  const auto* const known = std::ranges::find(kTypeHashes, type, &TypeHash::type);
  if (known != std::end(kTypeHashes)) told += fmt::format("typehash=RIHS01_{};", known->hash);
  if (!told.empty()) dds_qset_userdata(qos.get(), told.data(), told.size());
  dds_qset_reliability(qos.get(), quality.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, kMaxBlocking);
  dds_qset_durability(qos.get(), quality.latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, quality.depth);
  return qos;
}

std::string said_under(const dds_qos_t* qos, std::string_view key) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size) || data == nullptr) return {};
  const std::string all = ";" + std::string(static_cast<const char*>(data), size);
  dds_free(data);
  const std::string begin = fmt::format(";{}=", key);
  const std::size_t at = all.find(begin);
  if (at == std::string::npos) return {};
  const std::size_t value = at + begin.size();
  return all.substr(value, all.find(';', value) - value);
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
