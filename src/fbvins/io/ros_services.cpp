// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/ros_services.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/io/cdr.hpp"

namespace fbvins {
namespace {

/// More names in one request are those of an attacker.
constexpr std::uint32_t kMostNames = 10'000;

using Value = decltype(RosParameter::value);

/// rcl_interfaces/ParameterType has the numbers of Value's alternatives.
std::uint8_t type_of(const Value& value) { return static_cast<std::uint8_t>(value.index()); }

template <class T>
T value_or_none(const Value& value) {
  const T* here = std::get_if<T>(&value);
  return here != nullptr ? *here : T{};
}

void put_bool(CdrWriter& cdr, bool value) { cdr.put(static_cast<std::uint8_t>(value)); }

void put_texts(CdrWriter& cdr, std::span<const std::string> texts) {
  cdr.count(texts.size());
  for (const std::string& text : texts) cdr.text(text);
}

/// All fields are sent, whatever the type.
void put_value(CdrWriter& cdr, const Value& value) {
  cdr.put(type_of(value));
  put_bool(cdr, value_or_none<bool>(value));
  cdr.put(value_or_none<std::int64_t>(value));
  cdr.put(value_or_none<double>(value));
  cdr.text(value_or_none<std::string>(value));
  constexpr int kArrays = 5;
  for (int i = 0; i < kArrays; ++i) cdr.count(0);
}

void put_descriptor(CdrWriter& cdr, const RosParameter& parameter) {
  const bool ranged = parameter.min < parameter.max;
  const bool whole = std::holds_alternative<std::int64_t>(parameter.value),
             number = std::holds_alternative<double>(parameter.value);
  cdr.text(parameter.name);
  cdr.put(type_of(parameter.value));
  cdr.text(parameter.description);
  cdr.text(parameter.constraints);
  put_bool(cdr, true);   // read only
  put_bool(cdr, false);  // its type does not change
  cdr.count(ranged && number ? 1 : 0);
  if (ranged && number)
    for (const double x : {parameter.min, parameter.max, 0.0}) cdr.put(x);
  cdr.count(ranged && whole ? 1 : 0);
  if (ranged && whole)
    for (const double x : {parameter.min, parameter.max, 1.0}) cdr.put(std::llround(x));
}

void put_refusal(CdrWriter& cdr, std::string_view reason) {
  put_bool(cdr, false);
  cdr.text(reason);
}

std::vector<std::string> get_texts(CdrReader& cdr) {
  std::vector<std::string> texts;
  const auto count = std::min(cdr.get<std::uint32_t>(), kMostNames + 1);
  for (std::uint32_t i = 0; i < count && cdr.ok(); ++i) texts.emplace_back(cdr.text());
  return texts;
}

template <class Number>
void skip_numbers(CdrReader& cdr) {
  const auto count = cdr.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && cdr.ok(); ++i) cdr.get<Number>();
}

void skip_value(CdrReader& cdr) {
  cdr.get<std::uint8_t>();  // type
  cdr.get<std::uint8_t>();
  cdr.get<std::int64_t>();
  cdr.get<double>();
  cdr.text();
  cdr.bytes();
  cdr.bytes();  // truth values
  skip_numbers<std::int64_t>(cdr);
  skip_numbers<double>(cdr);
  get_texts(cdr);
}

struct Named {
  std::uint8_t id;
  const char* label;
};

Named named(RosLifecycle state) {
  const auto id = static_cast<std::uint8_t>(state);
  switch (state) {
    case RosLifecycle::inactive: return {id, "inactive"};
    case RosLifecycle::active: return {id, "active"};
    case RosLifecycle::finalized: return {id, "finalized"};
  }
  return {0, "unknown"};
}

/// lifecycle_msgs/Transition.
Named transition(RosLifecycle from, RosLifecycle to) {
  if (to == RosLifecycle::active) return {3, "activate"};
  if (to == RosLifecycle::inactive) return {4, "deactivate"};
  return from == RosLifecycle::active ? Named{7, "active_shutdown"} : Named{6, "inactive_shutdown"};
}

void put_named(CdrWriter& cdr, const Named& what) {
  cdr.put(what.id);
  cdr.text(what.label);
}

}  // namespace

void append_trigger_reply(std::string& out, bool success, std::string_view message) {
  CdrWriter cdr(out);
  put_bool(cdr, success);
  cdr.text(message);
}

bool is_empty_request(std::string_view bytes) {
  CdrReader cdr(bytes);
  cdr.get<std::uint8_t>();
  return cdr.ok();
}

std::optional<RosListRequest> read_list_request(std::string_view bytes) {
  CdrReader cdr(bytes);
  RosListRequest request;
  request.prefixes = get_texts(cdr);
  request.depth = cdr.get<std::uint64_t>();
  if (!cdr.ok() || request.prefixes.size() > kMostNames) return std::nullopt;
  return request;
}

void append_parameter_list(std::string& out, std::span<const std::string> names, std::span<const std::string> prefixes) {
  CdrWriter cdr(out);
  put_texts(cdr, names);
  put_texts(cdr, prefixes);
}

std::optional<std::vector<std::string>> read_names(std::string_view bytes) {
  CdrReader cdr(bytes);
  std::vector<std::string> names = get_texts(cdr);
  if (!cdr.ok() || names.size() > kMostNames) return std::nullopt;
  return names;
}

void append_parameter_values(std::string& out, std::span<const RosParameter> parameters) {
  CdrWriter cdr(out);
  cdr.count(parameters.size());
  for (const RosParameter& parameter : parameters) put_value(cdr, parameter.value);
}

void append_parameter_types(std::string& out, std::span<const RosParameter> parameters) {
  CdrWriter cdr(out);
  cdr.count(parameters.size());
  for (const RosParameter& parameter : parameters) cdr.put(type_of(parameter.value));
}

void append_parameter_descriptions(std::string& out, std::span<const RosParameter> parameters) {
  CdrWriter cdr(out);
  cdr.count(parameters.size());
  for (const RosParameter& parameter : parameters) put_descriptor(cdr, parameter);
}

std::optional<std::vector<std::string>> read_names_to_set(std::string_view bytes) {
  CdrReader cdr(bytes);
  std::vector<std::string> names;
  const auto count = cdr.get<std::uint32_t>();
  if (count > kMostNames) return std::nullopt;
  for (std::uint32_t i = 0; i < count && cdr.ok(); ++i) {
    names.emplace_back(cdr.text());
    skip_value(cdr);
  }
  if (!cdr.ok()) return std::nullopt;
  return names;
}

void append_refusals(std::string& out, std::span<const std::string> reasons) {
  CdrWriter cdr(out);
  cdr.count(reasons.size());
  for (const std::string& reason : reasons) put_refusal(cdr, reason);
}

void append_refusal(std::string& out, std::string_view reason) {
  CdrWriter cdr(out);
  put_refusal(cdr, reason);
}

void append_lifecycle_state(std::string& out, RosLifecycle state) {
  CdrWriter cdr(out);
  put_named(cdr, named(state));
}

void append_no_change(std::string& out) {
  CdrWriter cdr(out);
  put_bool(cdr, false);
}

bool is_change_request(std::string_view bytes) {
  CdrReader cdr(bytes);
  cdr.get<std::uint8_t>();
  cdr.text();
  return cdr.ok();
}

void append_no_transitions(std::string& out) { CdrWriter(out).count(0); }

void append_transition(std::string& out, std::uint64_t t_ns, RosLifecycle from, RosLifecycle to) {
  CdrWriter cdr(out);
  cdr.put(t_ns);
  put_named(cdr, transition(from, to));
  put_named(cdr, named(from));
  put_named(cdr, named(to));
}

}  // namespace fbvins
