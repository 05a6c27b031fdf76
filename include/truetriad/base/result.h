// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>
#include <variant>

#include "truetriad/base/error.h"

namespace truetriad {

/// A value or the reason why there is none. Spelled like std::expected, which needs C++23.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}      // NOLINT(google-explicit-constructor)
  Result(Error error) : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool has_value() const { return content_.index() == 0; }
  explicit operator bool() const { return has_value(); }

  T& value() & { return std::get<0>(content_); }
  const T& value() const& { return std::get<0>(content_); }
  T&& value() && { return std::get<0>(std::move(content_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  const Error& error() const { return std::get<1>(content_); }

 private:
  std::variant<T, Error> content_;
};

/// Success, or the reason for failure.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool has_value() const { return !error_.has_value(); }
  explicit operator bool() const { return has_value(); }
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};

}  // namespace truetriad

/// If `expression` (a Status or Result) has an error, returns that error from the enclosing
/// function.
#define TRUETRIAD_RETURN_IF_ERROR(expression)            \
  do {                                                   \
    if (auto&& status_or_ = (expression); !status_or_) { \
      return status_or_.error();                         \
    }                                                    \
  } while (false)

#define TRUETRIAD_JOIN_NAMES_OF(a, b) a##b
#define TRUETRIAD_JOIN_NAMES(a, b) TRUETRIAD_JOIN_NAMES_OF(a, b)

/// If the Result that follows has a value, sets `declaration` to it; otherwise returns the error
/// from the enclosing function: TRUETRIAD_ASSIGN_OR_RETURN(const Unit unit, ParseTriadUnit(triad,
/// name));
#define TRUETRIAD_ASSIGN_OR_RETURN(declaration, ...)            \
  auto TRUETRIAD_JOIN_NAMES(result_, __LINE__) = (__VA_ARGS__); \
  if (!TRUETRIAD_JOIN_NAMES(result_, __LINE__)) {               \
    return TRUETRIAD_JOIN_NAMES(result_, __LINE__).error();     \
  }                                                             \
  declaration = *std::move(TRUETRIAD_JOIN_NAMES(result_, __LINE__))
