// What went wrong, where, and how it is handed up: never ignored, never thrown across a folder.
#pragma once

#include <cassert>
#include <optional>
#include <string>
#include <utility>

namespace pneuma::base {

enum class StatusCode {
  ok,
  invalid_argument,
  not_found,
  already_exists,
  limit_exceeded,
  unauthenticated,
  failed_precondition,
  unsupported,
  malformed,
  unavailable,
  internal,
};

/// The outcome of work on outside input: a code, what was wrong, and where (a field path such as
/// `soft_bodies[0].mass_kg`, a file and line, a face or a vertex).
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(StatusCode code, std::string what, std::string where = {})
      : code_(code), what_(std::move(what)), where_(std::move(where)) {}

  [[nodiscard]] bool ok() const { return code_ == StatusCode::ok; }
  [[nodiscard]] StatusCode code() const { return code_; }
  [[nodiscard]] const std::string& what() const { return what_; }
  [[nodiscard]] const std::string& where() const { return where_; }

  /// The same failure, seen from further out: `outer` is put before `where`, joined by a dot
  /// (none before an index in brackets).
  [[nodiscard]] Status inside(const std::string& outer) const;

  /// One line: `where: what`, or `what` alone.
  [[nodiscard]] std::string message() const;

 private:
  StatusCode code_ = StatusCode::ok;
  std::string what_;
  std::string where_;
};

[[nodiscard]] inline Status invalid(std::string what, std::string where = {}) {
  return {StatusCode::invalid_argument, std::move(what), std::move(where)};
}
[[nodiscard]] inline Status not_found(std::string what, std::string where = {}) {
  return {StatusCode::not_found, std::move(what), std::move(where)};
}

/// A value, or the status that says why there is none.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : value_(std::move(value)) {}                                  // NOLINT(google-explicit-constructor)
  Result(Status status) : status_(std::move(status)) { assert(!status_.ok()); }  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return value_.has_value(); }
  [[nodiscard]] const Status& status() const { return status_; }
  [[nodiscard]] T& operator*() { return *value_; }
  [[nodiscard]] const T& operator*() const { return *value_; }
  [[nodiscard]] T* operator->() { return &*value_; }
  [[nodiscard]] const T* operator->() const { return &*value_; }

 private:
  std::optional<T> value_;
  Status status_;
};

}  // namespace pneuma::base
