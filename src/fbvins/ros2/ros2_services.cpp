// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_services.hpp"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <random>
#include <set>
#include <thread>
#include <utility>

#include "fbvins/ros2/cdr_type.hpp"
#include "fbvins/ros2/dds_wire.hpp"

namespace fbvins {
namespace {

constexpr int kRequestsWaiting = 100;
constexpr std::size_t kCdrHeader_bytes = 4;
/// How long a reply waits for its reader, which DDS may find later than the request's writer.
constexpr dds_duration_t kFindReader = DDS_MSECS(500), kFindPeriod = DDS_MSECS(10);

/// Between CDR's header and the fields: the client's number and the request's, which the reply repeats.
using RequestId = std::array<char, 16>;

/// As rmw_cyclonedds_cpp writes them: 16 bytes in hexadecimal, separated by dots.
std::string new_service_id() {
  std::random_device random;
  std::string out;
  for (int i = 0; i < 16; ++i) out += fmt::format("{}{:x}", i == 0 ? "" : ".", random() % 256);
  return out;
}

struct EndpointDeleter {
  void operator()(dds_builtintopic_endpoint_t* endpoint) const { dds_builtintopic_free_endpoint(endpoint); }
};
using Endpoint = std::unique_ptr<dds_builtintopic_endpoint_t, EndpointDeleter>;

std::string client_of(const Endpoint& endpoint) { return endpoint ? said_under(endpoint->qos, "clientid") : std::string(); }

struct Served {
  Ros2Services::Service service;
  DdsEntity request_topic, reply_topic, reader, writer, condition;
  const ddsi_sertype* reply_type = nullptr;

  bool finds_reader(const std::string& client) const {
    constexpr std::size_t kMost = 256;
    std::array<dds_instance_handle_t, kMost> readers{};
    const int count = dds_get_matched_subscriptions(writer.handle(), readers.data(), kMost);
    for (int k = 0; k < std::min(count, static_cast<int>(kMost)); ++k)
      if (client_of(Endpoint(dds_get_matched_subscription_data(writer.handle(), readers[static_cast<std::size_t>(k)]))) == client)
        return true;
    return false;
  }
};

}  // namespace

class Ros2Services::Desk : public std::enable_shared_from_this<Desk> {
 public:
  Desk(std::shared_ptr<Ros2Node> node, Say say) : node_(std::move(node)), say_(std::move(say)) {}

  Result<void> add(Service service) {
    Served s;
    s.service = std::move(service);
    const std::string request = s.service.type + "_Request", reply = s.service.type + "_Response";
    auto in = make_wire_topic(node_->participant(), fmt::format("rq{}Request", s.service.name), request);
    if (!in) return in.error();
    auto out = make_wire_topic(node_->participant(), fmt::format("rr{}Reply", s.service.name), reply);
    if (!out) return out.error();
    s.request_topic = std::move(in->entity);
    s.reply_topic = std::move(out->entity);
    s.reply_type = out->type;
    const Ros2Quality quality{.depth = kRequestsWaiting};
    const std::string id = fmt::format("serviceid={};", new_service_id());
    s.writer =
        DdsEntity(dds_create_writer(node_->participant(), s.reply_topic.handle(), make_qos(quality, reply, id).get(), nullptr));
    s.reader = DdsEntity(
        dds_create_reader(node_->participant(), s.request_topic.handle(), make_qos(quality, request, id).get(), nullptr));
    if (s.reader.handle() < 0) return dds_failure("ROS 2 service " + s.service.name, s.reader.handle());
    if (s.writer.handle() < 0) return dds_failure("ROS 2 service " + s.service.name, s.writer.handle());
    s.condition = DdsEntity(dds_create_readcondition(s.reader.handle(), DDS_ANY_STATE));
    if (Result<void> told = node_->tell_of_writer(s.writer.handle()); !told) return told;
    if (Result<void> told = node_->tell_of_reader(s.reader.handle()); !told) return told;
    served_.push_back(std::move(s));
    return {};
  }

  void open() {
    waitset_ = DdsEntity(dds_create_waitset(node_->participant()));
    ending_ = DdsEntity(dds_create_guardcondition(node_->participant()));
    dds_waitset_attach(waitset_.handle(), ending_.handle(), 0);
    for (const Served& s : served_) dds_waitset_attach(waitset_.handle(), s.condition.handle(), 0);
    thread_ = std::thread([this] {
      while (!ended_) {
        dds_waitset_wait(waitset_.handle(), nullptr, 0, DDS_INFINITY);
        for (const Served& s : served_) serve(s);
      }
    });
  }

  void close() {
    ended_ = true;
    if (!thread_.joinable()) return;
    dds_set_guardcondition(ending_.handle(), true);
    thread_.join();
  }

 private:
  void serve(const Served& s) {
    constexpr int kAtOnce = 16;
    std::array<ddsi_serdata*, kAtOnce> messages{};
    std::array<dds_sample_info_t, kAtOnce> about{};
    for (int count = kAtOnce; count == kAtOnce;) {
      count = dds_takecdr(s.reader.handle(), messages.data(), kAtOnce, about.data(), DDS_ANY_STATE);
      for (int k = 0; k < count; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const std::shared_ptr<ddsi_serdata> message(messages[i], ddsi_serdata_unref);
        if (about[i].valid_data && !ended_) answer(s, bytes_of(*message), about[i].publication_handle);
      }
    }
  }

  void answer(const Served& s, std::string_view bytes, dds_instance_handle_t asked_by) {
    const Endpoint asker(dds_get_matched_publication_data(s.reader.handle(), asked_by));
    if (!asker) return;  // it is gone
    const std::string client = client_of(asker);
    if (client.empty())
      return say_once(
          fmt::format("ROS 2 service {}: a client was not answered, as it does not ask in the way of rmw_cyclonedds_cpp; "
                      "start it with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp",
                      s.service.name));
    RequestId id{};
    if (bytes.size() < kCdrHeader_bytes + id.size()) return say_odd(s);
    std::memcpy(id.data(), bytes.data() + kCdrHeader_bytes, id.size());
    // Both numbers have 8 bytes: without them the fields are aligned as before.
    const std::string request = std::string(bytes.substr(0, kCdrHeader_bytes)).append(bytes.substr(kCdrHeader_bytes + id.size()));
    const Reply reply = [desk = weak_from_this(), &s, id, client](std::string message) {
      if (const auto here = desk.lock()) here->send(s, id, client, message);
    };
    if (!s.service.handle(request, reply)) say_odd(s);
  }

  void send(const Served& s, const RequestId& id, const std::string& client, const std::string& message) {
    for (dds_duration_t waited = 0; !s.finds_reader(client) && waited < kFindReader; waited += kFindPeriod)
      dds_sleepfor(kFindPeriod);
    std::string bytes = message.substr(0, kCdrHeader_bytes);
    bytes.append(id.data(), id.size()).append(message, kCdrHeader_bytes);
    if (Result<void> sent = write_bytes(s.writer.handle(), *s.reply_type, std::move(bytes), s.service.name); !sent)
      say_once(sent.error().message);
  }

  void say_odd(const Served& s) {
    say_once(fmt::format("ROS 2 service {}: a request of another form was left out", s.service.name));
  }
  void say_once(const std::string& sentence) {
    {
      const std::lock_guard lock(said_mutex_);
      if (!said_.insert(sentence).second) return;
    }
    say_(sentence);
  }

  std::shared_ptr<Ros2Node> node_;
  Say say_;
  std::vector<Served> served_;  // unchanged from open() on
  std::mutex said_mutex_;
  std::set<std::string> said_;
  DdsEntity waitset_, ending_;
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

Result<std::unique_ptr<Ros2Services>> Ros2Services::create(std::shared_ptr<Ros2Node> node, std::vector<Service> services,
                                                           Say say) {
  auto desk = std::make_shared<Desk>(std::move(node), std::move(say));
  for (Service& service : services)
    if (Result<void> added = desk->add(std::move(service)); !added) return added.error();
  desk->open();
  return std::unique_ptr<Ros2Services>(new Ros2Services(std::move(desk)));
}

Ros2Services::~Ros2Services() { desk_->close(); }

}  // namespace fbvins
