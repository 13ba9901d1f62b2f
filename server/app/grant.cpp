#include "app/grant.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/limits.h"

namespace pneuma::app {

namespace {

constexpr std::array<std::pair<Role, std::string_view>, 3> roles{
    {{Role::view, "view"}, {Role::edit, "edit"}, {Role::admin, "admin"}}};

bool is_name_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
}

}  // namespace

std::string_view name_of(Role role) {
  const auto* found = std::ranges::find(roles, role, &std::pair<Role, std::string_view>::first);
  return found == roles.end() ? "none" : found->second;
}

std::optional<Role> role_named(std::string_view name) {
  const auto* found = std::ranges::find(roles, name, &std::pair<Role, std::string_view>::second);
  if (found == roles.end()) return std::nullopt;
  return found->first;
}

v1::Welcome::Role to_wire(Role role) {
  switch (role) {
    case Role::none:
      return v1::Welcome::ROLE_UNSPECIFIED;
    case Role::view:
      return v1::Welcome::VIEW;
    case Role::edit:
      return v1::Welcome::EDIT;
    case Role::admin:
      return v1::Welcome::ADMIN;
  }
  return v1::Welcome::ROLE_UNSPECIFIED;
}

base::Result<WorldPattern> WorldPattern::parse(std::string_view text) {
  const std::string_view name = text.ends_with('*') ? text.substr(0, text.size() - 1) : text;
  if (text.empty() || text.size() > base::name_bytes_max || !std::ranges::all_of(name, is_name_letter)) {
    return base::invalid(
        std::string("'").append(text).append("' is no world's name, no prefix such as lab-*, and not *"));
  }
  WorldPattern pattern;
  pattern.text_ = text;
  return pattern;
}

bool WorldPattern::covers(std::string_view world) const {
  if (!text_.ends_with('*')) return world == text_;
  return world.starts_with(std::string_view(text_).substr(0, text_.size() - 1));
}

const GrantPtr& everything() {
  static const GrantPtr grant = std::make_shared<const Grant>(Grant{{}, Role::admin, {}, {}});
  return grant;
}

v1::Error denied(std::string what, std::string where) {
  v1::Error error;
  error.set_code(v1::Error::PERMISSION_DENIED);
  error.set_what(std::move(what));
  error.set_where(std::move(where));
  return error;
}

Denial check_world(const Grant& grant, const std::string& world, const std::string& field) {
  if (grant.worlds.covers(world)) return std::nullopt;
  return denied("this token is for " + grant.worlds.text() + " alone", field);
}

}  // namespace pneuma::app
