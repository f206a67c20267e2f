// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/ros2_parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <set>

namespace fbvins {
namespace {

/// The groups in which the names lie: "live.ros2" of "live.ros2.clock".
std::vector<std::string> groups_of(const std::vector<std::string>& names) {
  std::set<std::string> groups;
  for (const std::string& name : names)
    if (const auto dot = name.rfind('.'); dot != std::string::npos) groups.insert(name.substr(0, dot));
  return {groups.begin(), groups.end()};
}

/// Whether `name` lies below `prefix`, "" being the root, at most `depth` levels, 0: any.
bool lies_below(std::string_view name, std::string_view prefix, std::uint64_t depth) {
  std::string_view rest = name;
  if (!prefix.empty()) {
    if (name == prefix) return true;
    if (!name.starts_with(prefix) || name[prefix.size()] != '.') return false;
    rest = name.substr(prefix.size() + 1);
  }
  return depth == 0 || static_cast<std::uint64_t>(std::ranges::count(rest, '.')) < depth;
}

}  // namespace

std::vector<RosParameter> Ros2Parameters::chosen(const std::vector<std::string>& names) const {
  std::vector<RosParameter> out;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(parameters_, name, &RosParameter::name);
    out.push_back(found == parameters_.end() ? RosParameter{name, {}, {}, {}} : *found);
  }
  return out;
}

std::vector<std::string> Ros2Parameters::listed(const RosListRequest& request) const {
  std::vector<std::string> out;
  for (const RosParameter& p : parameters_) {
    const bool wanted = request.prefixes.empty() ? lies_below(p.name, "", request.depth)
                                                 : std::ranges::any_of(request.prefixes, [&](const std::string& prefix) {
                                                     return lies_below(p.name, prefix, request.depth);
                                                   });
    if (wanted) out.push_back(p.name);
  }
  return out;
}

std::vector<std::string> Ros2Parameters::refusals(const std::vector<std::string>& names) const {
  std::vector<std::string> reasons;
  for (const RosParameter& p : chosen(names))
    reasons.push_back(p.value.index() == 0
                          ? fmt::format("'{}' is no option of this flight", p.name)
                          : fmt::format("'{0}' is fixed for the flight, as estimator and outputs are built with it: "
                                        "start fbvins live with --set {0}=VALUE",
                                        p.name));
  return reasons;
}

std::vector<Ros2Services::Service> Ros2Parameters::services(const Ros2Node& node) const {
  const auto here = std::make_shared<const Ros2Parameters>(*this);
  /// A service of rcl_interfaces: `read` takes the request, `append` what it holds to the reply.
  const auto service = [&](const char* name, const char* type, auto read, auto append) {
    return Ros2Services::Service{node.own_topic(name), std::string("rcl_interfaces/srv/") + type,
                                 [read, append](std::string_view bytes, const Ros2Services::Reply& reply) {
                                   const auto request = read(bytes);
                                   if (!request) return false;
                                   std::string message;
                                   append(message, *request);
                                   reply(std::move(message));
                                   return true;
                                 }};
  };
  using Names = std::vector<std::string>;
  return {service("list_parameters", "ListParameters", read_list_request,
                  [here](std::string& out, const RosListRequest& request) {
                    const Names names = here->listed(request);
                    append_parameter_list(out, names, groups_of(names));
                  }),
          service("get_parameters", "GetParameters", read_names,
                  [here](std::string& out, const Names& names) { append_parameter_values(out, here->chosen(names)); }),
          service("get_parameter_types", "GetParameterTypes", read_names,
                  [here](std::string& out, const Names& names) { append_parameter_types(out, here->chosen(names)); }),
          service("describe_parameters", "DescribeParameters", read_names,
                  [here](std::string& out, const Names& names) { append_parameter_descriptions(out, here->chosen(names)); }),
          service("set_parameters", "SetParameters", read_names_to_set,
                  [here](std::string& out, const Names& names) { append_refusals(out, here->refusals(names)); }),
          service("set_parameters_atomically", "SetParametersAtomically", read_names_to_set,
                  [here](std::string& out, const Names& names) {
                    const Names reasons = here->refusals(names);
                    append_refusal(out, reasons.empty() ? "nothing was to be set" : reasons.front());
                  })};
}

}  // namespace fbvins
