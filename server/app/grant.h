// What a token allows: a role, in some worlds, for some time.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/status.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// Each may do what those before it may. `none`: has not said hello.
enum class Role : std::uint8_t { none, view, edit, admin };

[[nodiscard]] std::string_view name_of(Role role);
/// Nothing where no token can have a role of that name.
[[nodiscard]] std::optional<Role> role_named(std::string_view name);
[[nodiscard]] v1::Welcome::Role to_wire(Role role);

/// A world's name, a prefix with '*' behind it, or '*' alone for all worlds.
class WorldPattern {
 public:
  /// All worlds.
  WorldPattern() = default;
  [[nodiscard]] static base::Result<WorldPattern> parse(std::string_view text);

  [[nodiscard]] bool covers(std::string_view world) const;
  [[nodiscard]] const std::string& text() const { return text_; }
  bool operator==(const WorldPattern&) const = default;

 private:
  std::string text_ = "*";
};

struct Grant {
  std::string token_id;  // empty: no token was asked for
  Role role = Role::none;
  WorldPattern worlds;
  std::optional<std::chrono::sys_seconds> expires;  // nothing: never

  bool operator==(const Grant&) const = default;
};
using GrantPtr = std::shared_ptr<const Grant>;

/// Whether who asks may hear of the world of this name.
using MayName = std::function<bool(std::string_view world)>;

/// Where no token is asked for, everyone may do everything.
[[nodiscard]] const GrantPtr& everything();

/// PERMISSION_DENIED, or nothing where what was asked is allowed.
using Denial = std::optional<v1::Error>;
[[nodiscard]] v1::Error denied(std::string what, std::string where);
/// Where the grant is not for that world; `field` names it in the request.
[[nodiscard]] Denial check_world(const Grant& grant, const std::string& world, const std::string& field);

}  // namespace pneuma::app
