// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_node.hpp"

#include <dds/dds.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>
#include <utility>

#include "fbvins/ros2/cdr_type.hpp"
#include "fbvins/ros2/dds_wire.hpp"

namespace fbvins {
namespace {

constexpr std::uint32_t kMaxDomain = 232;  // DDS derives port numbers from the domain
/// Of ROS's own discovery: not below rt/, as it is no topic of a node.
constexpr const char* kGraphTopic = "ros_discovery_info";
constexpr const char* kGraphType = "rmw_dds_common/msg/ParticipantEntitiesInfo";
/// Which security policy a participant has: ROS's default.
constexpr std::string_view kEnclave = "enclave=/;";

// This machine alone: peers are contacted one by one at its own addresses, without multicast. ROS 2 Humble's nodes have the
// loopback as their only interface then; those since Iron have the network's, and neither kind takes addresses of the other's: so
// there are both.
constexpr const char* kThisMachine =
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address=\"127.0.0.1\"/>{}</Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer address=\"127.0.0.1\"/>{}</Peers></Discovery></Domain></CycloneDDS>";
constexpr const char* kNetworkAsWell = "<NetworkInterface autodetermine=\"true\"/>";
constexpr const char* kOneInterface =
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"{}\"/></Interfaces></General></Domain></CycloneDDS>";

/// This machine's addresses in networks, as peers. Without one CycloneDDS finds the loopback alone, which may not be named twice.
std::string own_addresses() {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return {};
  std::string peers;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    if ((one->ifa_flags & IFF_UP) == 0 || (one->ifa_flags & IFF_LOOPBACK) != 0) continue;
    char text[NI_MAXHOST] = {};
    if (getnameinfo(one->ifa_addr, sizeof(sockaddr_in), text, sizeof text, nullptr, 0, NI_NUMERICHOST) == 0)
      peers += fmt::format("<Peer address=\"{}\"/>", text);
  }
  freeifaddrs(all);
  return peers;
}

std::string configuration_of(const Ros2Address& address, bool humble) {
  if (!address.interface.empty()) return fmt::format(fmt::runtime(kOneInterface), address.interface);
  const std::string peers = humble ? "" : own_addresses();
  return fmt::format(fmt::runtime(kThisMachine), peers.empty() ? "" : kNetworkAsWell, peers);
}

Result<TopicOfBytes> make_topic(const Ros2Node& node, const std::string& topic, const std::string& type) {
  if (topic.empty() || topic[0] != '/')
    return Error{ErrorCode::invalid_argument, fmt::format("ROS 2 topic '{}': it begins with /", topic)};
  return make_wire_topic(node.participant(), wire_topic(topic), type);
}

DdsGuid guid_of(dds_entity_t entity) {
  dds_guid_t guid{};
  dds_get_guid(entity, &guid);
  DdsGuid out;
  std::copy(std::begin(guid.v), std::end(guid.v), out.begin());
  return out;
}

bool is_ros_name(std::string_view text) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  return !text.empty() && letter(text[0]) &&
         std::ranges::all_of(text, [&](char c) { return letter(c) || (c >= '0' && c <= '9'); });
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

Result<Ros2Name> parse_ros2_node(const std::string& text) {
  const std::size_t last = text.rfind('/');
  Ros2Name out;
  out.name = last == std::string::npos ? text : text.substr(last + 1);
  bool good = is_ros_name(out.name) && (last == std::string::npos || text[0] == '/');
  if (good && last != std::string::npos && last > 0) {
    out.name_space = text.substr(0, last);
    good = out.name_space.size() > 1;
    for (std::size_t begin = 1, end = 0; begin < out.name_space.size(); begin = end + 1) {
      end = std::min(out.name_space.find('/', begin), out.name_space.size());
      good = good && is_ros_name(std::string_view(out.name_space).substr(begin, end - begin));
    }
    good = good && out.name_space.back() != '/';
  }
  if (good) return out;
  return Error{ErrorCode::invalid_argument,
               fmt::format("ROS 2 node '{}': NAME or /NAMESPACE/NAME, of letters, digits and underscores", text)};
}

DdsEntity::~DdsEntity() {
  if (handle_ > 0) dds_delete(handle_);
}

Result<std::shared_ptr<Ros2Node>> Ros2Node::join(const Ros2Address& address, const Ros2Name& name, bool humble,
                                                 const Ros2QualityWishes& wishes) {
  const std::string configuration = configuration_of(address, humble);
  auto node = std::make_shared<Ros2Node>();
  const std::string where =
      fmt::format("ROS 2 domain {}{}{}", address.domain, address.interface.empty() ? "" : " on ", address.interface);
  node->domain_ = DdsEntity(dds_create_domain(address.domain, configuration.c_str()));
  if (node->domain_.handle() < 0) return dds_failure(where, node->domain_.handle());
  const Qos qos(dds_create_qos());
  dds_qset_userdata(qos.get(), kEnclave.data(), kEnclave.size());
  node->participant_ = DdsEntity(dds_create_participant(address.domain, qos.get(), nullptr));
  if (node->participant() < 0) return dds_failure(where, node->participant());
  node->self_ = {name.name_space, name.name, {}, {}};
  node->humble_ = humble;
  node->wishes_ = wishes;
  auto topic = make_wire_topic(node->participant(), kGraphTopic, kGraphType);
  if (!topic) return topic.error();
  node->graph_topic_ = std::move(topic->entity);
  node->graph_type_ = topic->type;
  node->graph_ = DdsEntity(dds_create_writer(node->participant(), node->graph_topic_.handle(),
                                             make_qos({.latched = true, .depth = 1}, kGraphType).get(), nullptr));
  if (node->graph_.handle() < 0) return dds_failure(kGraphTopic, node->graph_.handle());
  if (Result<void> told = node->tell(); !told) return told.error();
  return node;
}

std::string Ros2Node::own_topic(const std::string& name) const {
  return fmt::format("{}/{}/{}", self_.name_space == "/" ? "" : self_.name_space, self_.name, name);
}

Ros2Quality Ros2Node::quality(const std::string& topic, Ros2Quality usual) {
  const std::lock_guard lock(mutex_);
  topics_.insert(topic);
  for (const auto& [name, wish] : wishes_) {
    if (topic != name && topic != own_topic(name)) continue;
    usual.reliable = wish.reliable.value_or(usual.reliable);
    usual.latched = wish.latched.value_or(usual.latched);
    usual.depth = wish.depth.value_or(usual.depth);
  }
  return usual;
}

std::string Ros2Node::unused_wish() const {
  const std::lock_guard lock(mutex_);
  for (const auto& [name, wish] : wishes_)
    if (!topics_.contains(name) && !topics_.contains(own_topic(name))) return name;
  return {};
}

Result<void> Ros2Node::tell_of_writer(std::int32_t writer) {
  const std::lock_guard lock(mutex_);
  self_.writers.push_back(guid_of(writer));
  return tell();
}

Result<void> Ros2Node::tell_of_reader(std::int32_t reader) {
  const std::lock_guard lock(mutex_);
  self_.readers.push_back(guid_of(reader));
  return tell();
}

void Ros2Node::forget_reader(std::int32_t reader) {
  const std::lock_guard lock(mutex_);
  std::erase(self_.readers, guid_of(reader));
}

Result<void> Ros2Node::tell() {
  std::string message;
  append_node(message, guid_of(participant()), self_, humble_);
  return write_bytes(graph_.handle(), *graph_type_, std::move(message), kGraphTopic);
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
  const Qos qos = make_qos(publisher.node_->quality(topic, quality), type);
  publisher.writer_ = DdsEntity(dds_create_writer(publisher.node_->participant(), publisher.topic_.handle(), qos.get(), nullptr));
  if (publisher.writer_.handle() < 0) return dds_failure(publisher.name_, publisher.writer_.handle());
  if (Result<void> told = publisher.node_->tell_of_writer(publisher.writer_.handle()); !told) return told.error();
  return publisher;
}

Result<void> Ros2Publisher::publish(std::string message) const {
  return write_bytes(writer_.handle(), *type_, std::move(message), name_);
}

int Ros2Publisher::subscribers() const {
  dds_publication_matched_status_t status{};
  return dds_get_publication_matched_status(writer_.handle(), &status) < 0 ? 0 : static_cast<int>(status.current_count);
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
  if (reader_.handle() > 0) node_->forget_reader(reader_.handle());
  reader_ = DdsEntity();
  reliable_ = reliable;
  const Qos qos = make_qos(node_->quality(name_, {.reliable = reliable, .latched = false, .depth = depth_}), type_);
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
  reader_ = DdsEntity(dds_create_reader(node_->participant(), topic_.handle(), qos.get(), listener.get()));
  if (reader_.handle() < 0) return dds_failure("ROS 2 topic " + name_, reader_.handle());
  return node_->tell_of_reader(reader_.handle());
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
