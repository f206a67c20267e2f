// SPDX-License-Identifier: Apache-2.0
// Result<T>: a value, or an Error that says in one sentence what is wrong with an input from outside the program:
// a file, calibration, socket, set of weights. A bug is an assertion; trouble in estimation is a Health.
//
//   Result<Config> config = load_config("drone.yaml");
//   if (!config) { report(config.error().message); return 2; }
//   use(*config);
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace fbvins {

enum class ErrorCode { not_found, unreadable, malformed, unsupported, invalid_argument, unwritable, stage_failed };

struct Error {
  ErrorCode code = ErrorCode::invalid_argument;
  std::string message;  ///< one sentence, with file and line or field where there is one
};

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit by design
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& operator*() & { return std::get<0>(state_); }
  const T& operator*() const& { return std::get<0>(state_); }
  T&& operator*() && { return std::get<0>(std::move(state_)); }
  T* operator->() { return &std::get<0>(state_); }
  const T* operator->() const { return &std::get<0>(state_); }
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

/// Success without a value.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT: implicit by design

  bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};

}  // namespace fbvins
