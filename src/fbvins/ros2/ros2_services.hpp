// SPDX-License-Identifier: Apache-2.0
// Services of a node, as rmw_cyclonedds_cpp asks for them: a request on rq/<name>Request and its reply on rr/<name>Reply both
// begin with the client's number and that of the request. (rmw_fastrtps_cpp has both outside the message, which CycloneDDS cannot
// send: its clients are refused with a sentence.)
//
//   auto services = Ros2Services::create(node, {{node->own_topic("reset"), "std_srvs/srv/Trigger", [&](auto request, auto reply)
//   {
//     if (!is_empty_request(request)) return false;
//     reply(...);
//     return true;
//   }}}, say);
//
// Threads: all requests are handled on one thread, the services' own, one after the other. A reply may be given later, from any
// thread; once the services are gone nothing becomes of it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/ros2/ros2_node.hpp"

namespace fbvins {

class Ros2Services {
 public:
  /// The message with its CDR header. Called once.
  using Reply = std::function<void(std::string message)>;
  /// False: the bytes are no such request.
  using Handler = std::function<bool(std::string_view request, const Reply& reply)>;
  struct Service {
    std::string name, type;  ///< as ROS has them: "/fbvins/reset", "std_srvs/srv/Trigger"
    Handler handle;
  };
  using Say = std::function<void(const std::string& sentence)>;

  static Result<std::unique_ptr<Ros2Services>> create(std::shared_ptr<Ros2Node> node, std::vector<Service> services, Say say);
  ~Ros2Services();
  Ros2Services(const Ros2Services&) = delete;
  Ros2Services& operator=(const Ros2Services&) = delete;

 private:
  class Desk;
  explicit Ros2Services(std::shared_ptr<Desk> desk) : desk_(std::move(desk)) {}
  std::shared_ptr<Desk> desk_;
};

}  // namespace fbvins
