// SPDX-License-Identifier: Apache-2.0
// The services with which `ros2 param` lists, reads and describes a node's parameters. They are options of a flight that is going
// on: to set one is refused. One thread.
#pragma once

#include <string>
#include <vector>

#include "fbvins/io/ros_services.hpp"
#include "fbvins/ros2/ros2_services.hpp"

namespace fbvins {

class Ros2Parameters {
 public:
  explicit Ros2Parameters(std::vector<RosParameter> parameters) : parameters_(std::move(parameters)) {}

  /// Of `node`; they hold a copy of the parameters.
  std::vector<Ros2Services::Service> services(const Ros2Node& node) const;

  /// In the order asked for; without a value where there is no such parameter.
  std::vector<RosParameter> chosen(const std::vector<std::string>& names) const;
  /// The names that a request lists.
  std::vector<std::string> listed(const RosListRequest& request) const;
  /// Why none of these can be set, one reason each.
  std::vector<std::string> refusals(const std::vector<std::string>& names) const;

 private:
  std::vector<RosParameter> parameters_;
};

}  // namespace fbvins
