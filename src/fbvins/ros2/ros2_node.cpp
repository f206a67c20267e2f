// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_node.hpp"

#include <dds/dds.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "fbvins/ros2/cdr_type.hpp"

namespace fbvins {
namespace {

constexpr std::uint32_t kMaxDomain = 232;  // DDS derives port numbers from the domain
constexpr dds_duration_t kMaxBlocking = DDS_MSECS(100);

// This machine alone; peers are contacted one by one, as the loopback has no multicast.
constexpr const char* kLoopback =
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>";
constexpr const char* kOneInterface =
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"{}\"/></Interfaces></General></Domain></CycloneDDS>";

Error failure(std::string_view what, dds_return_t code) {
  return Error{ErrorCode::unwritable, fmt::format("{}: {}", what, dds_strretcode(code))};
}

/// "nav_msgs/msg/Odometry" -> "nav_msgs::msg::dds_::Odometry_"
std::string wire_type(const std::string& type) {
  const auto first = type.find('/'), last = type.rfind('/');
  return fmt::format("{}::{}::dds_::{}_", type.substr(0, first), type.substr(first + 1, last - first - 1), type.substr(last + 1));
}

/// "/tf" -> "rt/tf"
std::string wire_topic(const std::string& topic) { return "rt" + topic; }

struct DeleteQos {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, DeleteQos>;

Qos make_qos(const Ros2Quality& quality) {
  Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), quality.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, kMaxBlocking);
  dds_qset_durability(qos.get(), quality.latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, quality.depth);
  return qos;
}

struct TopicOfBytes {
  DdsEntity entity;
  const ddsi_sertype* type;
};

Result<TopicOfBytes> make_topic(const Ros2Node& node, const std::string& topic, const std::string& type) {
  if (topic.empty() || topic[0] != '/')
    return Error{ErrorCode::invalid_argument, fmt::format("ROS 2 topic '{}': it begins with /", topic)};
  ddsi_sertype* bytes = make_cdr_type(wire_type(type));
  const dds_entity_t made =
      dds_create_topic_sertype(node.participant(), wire_topic(topic).c_str(), &bytes, nullptr, nullptr, nullptr);
  if (made >= 0) return TopicOfBytes{DdsEntity(made), bytes};
  ddsi_sertype_unref(bytes);
  return failure("ROS 2 topic " + topic, made);
}

}  // namespace

Result<Ros2Address> parse_ros2_address(const std::string& text) {
  const auto colon = text.find(':');
  const std::string number = text.substr(0, colon);
  Ros2Address address;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), address.domain);
  if (error != std::errc() || end != number.data() + number.size() || address.domain > kMaxDomain)
    return Error{ErrorCode::invalid_argument, fmt::format("ROS 2 domain '{}': a number from 0 to {}", number, kMaxDomain)};
  if (colon == std::string::npos) return address;
  address.interface = text.substr(colon + 1);
  constexpr std::string_view kNameCharacters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.:";
  if (address.interface.empty() || address.interface.find_first_not_of(kNameCharacters) != std::string::npos)
    return Error{ErrorCode::invalid_argument, fmt::format("'{}' is no name of a network interface", address.interface)};
  return address;
}

DdsEntity::~DdsEntity() {
  if (handle_ > 0) dds_delete(handle_);
}

Result<std::shared_ptr<Ros2Node>> Ros2Node::join(const Ros2Address& address) {
  const std::string configuration =
      address.interface.empty() ? kLoopback : fmt::format(fmt::runtime(kOneInterface), address.interface);
  auto node = std::make_shared<Ros2Node>();
  const std::string where =
      fmt::format("ROS 2 domain {}{}{}", address.domain, address.interface.empty() ? "" : " on ", address.interface);
  node->domain_ = DdsEntity(dds_create_domain(address.domain, configuration.c_str()));
  if (node->domain_.handle() < 0) return failure(where, node->domain_.handle());
  node->participant_ = DdsEntity(dds_create_participant(address.domain, nullptr, nullptr));
  if (node->participant() < 0) return failure(where, node->participant());
  return node;
}

Result<Ros2Publisher> Ros2Publisher::create(std::shared_ptr<Ros2Node> node, const std::string& topic, const std::string& type,
                                            const Ros2Quality& quality) {
  auto made = make_topic(*node, topic, type);
  if (!made) return made.error();
  Ros2Publisher publisher;
  publisher.name_ = "ROS 2 topic " + topic;
  publisher.node_ = std::move(node);
  publisher.topic_ = std::move(made->entity);
  publisher.type_ = made->type;
  publisher.writer_ =
      DdsEntity(dds_create_writer(publisher.node_->participant(), publisher.topic_.handle(), make_qos(quality).get(), nullptr));
  if (publisher.writer_.handle() < 0) return failure(publisher.name_, publisher.writer_.handle());
  return publisher;
}

Result<void> Ros2Publisher::publish(std::string message) const {
  const dds_return_t code = dds_writecdr(writer_.handle(), make_cdr_message(*type_, std::move(message)));
  if (code == DDS_RETCODE_OK || code == DDS_RETCODE_TIMEOUT) return {};  // a reader that does not read is no error
  return failure(name_, code);
}

Result<std::unique_ptr<Ros2Subscriber>> Ros2Subscriber::create(std::shared_ptr<Ros2Node> node, const std::string& topic,
                                                               const std::string& type, int depth, OnMessage on_message) {
  auto made = make_topic(*node, topic, type);
  if (!made) return made.error();
  std::unique_ptr<Ros2Subscriber> subscriber(new Ros2Subscriber());
  subscriber->node_ = std::move(node);
  subscriber->name_ = topic;
  subscriber->type_ = type;
  subscriber->depth_ = depth;
  subscriber->on_message_ = std::move(on_message);
  subscriber->topic_ = std::move(made->entity);
  subscriber->offers_ =
      DdsEntity(dds_create_reader(subscriber->node_->participant(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr));
  if (Result<void> listening = subscriber->listen(false); !listening) return listening.error();
  return subscriber;
}

Ros2Subscriber::~Ros2Subscriber() { reader_ = DdsEntity(); }  // first: its thread uses the other members

Result<void> Ros2Subscriber::listen(bool reliable) {
  reader_ = DdsEntity();
  reliable_ = reliable;
  const std::unique_ptr<dds_listener_t, decltype(&dds_delete_listener)> listener(dds_create_listener(this), &dds_delete_listener);
  dds_lset_data_available(listener.get(), [](dds_entity_t reader, void* self) {
    constexpr int kAtOnce = 16;
    std::array<ddsi_serdata*, kAtOnce> messages{};
    std::array<dds_sample_info_t, kAtOnce> about{};
    for (;;) {
      const int count = dds_takecdr(reader, messages.data(), kAtOnce, about.data(), DDS_ANY_STATE);
      for (int k = 0; k < count; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const std::shared_ptr<ddsi_serdata> message(messages[i], ddsi_serdata_unref);
        if (about[i].valid_data) static_cast<Ros2Subscriber*>(self)->on_message_(bytes_of(*message), message);
      }
      if (count < kAtOnce) return;
    }
  });
  reader_ =
      DdsEntity(dds_create_reader(node_->participant(), topic_.handle(),
                                  make_qos({.reliable = reliable, .latched = false, .depth = depth_}).get(), listener.get()));
  if (reader_.handle() < 0) return failure("ROS 2 topic " + name_, reader_.handle());
  return {};
}

int Ros2Subscriber::publishers() const {
  dds_subscription_matched_status_t status{};
  return dds_get_subscription_matched_status(reader_.handle(), &status) < 0 ? 0 : static_cast<int>(status.current_count);
}

Result<void> Ros2Subscriber::look_around() {
  constexpr int kAtOnce = 64;
  std::array<void*, kAtOnce> samples{};
  std::array<dds_sample_info_t, kAtOnce> about{};
  std::string other_type;
  int count = 0;
  do {
    count = dds_take(offers_.handle(), samples.data(), about.data(), kAtOnce, kAtOnce);
    for (int k = 0; k < count; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const auto* offer = static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
      offered_reliable_.erase(about[i].instance_handle);
      if (!about[i].valid_data || about[i].instance_state != DDS_ALIVE_INSTANCE_STATE || wire_topic(name_) != offer->topic_name)
        continue;
      dds_reliability_kind_t kind{};
      dds_duration_t blocking{};
      if (wire_type(type_) != offer->type_name) other_type = offer->type_name;
      else if (dds_qget_reliability(offer->qos, &kind, &blocking))
        offered_reliable_[about[i].instance_handle] = kind == DDS_RELIABILITY_RELIABLE;
    }
    if (count > 0) dds_return_loan(offers_.handle(), samples.data(), count);
  } while (count == kAtOnce);
  const bool all_reliable =
      std::all_of(offered_reliable_.begin(), offered_reliable_.end(), [](const auto& offer) { return offer.second; });
  if (!offered_reliable_.empty() && all_reliable != reliable_) return listen(all_reliable);
  if (!other_type.empty())
    return Error{ErrorCode::invalid_argument,
                 fmt::format("ROS 2 topic {} carries {}, not {}", name_, other_type, wire_type(type_))};
  return {};
}

}  // namespace fbvins
