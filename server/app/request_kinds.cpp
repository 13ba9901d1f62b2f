#include "app/request_kinds.h"

#include <algorithm>
#include <array>

#include "app/protocol.h"

namespace pneuma::app {

namespace {

using Message = v1::ClientMessage;

struct Kind {
  Message::RequestCase request;
  Role role;                                    // the least that may ask it
  const std::string* (*world)(const Message&);  // that it names; null: none
  bool looks_at_bodies = false;
};

template <auto get>
const std::string* named_in(const Message& message) {
  return &(message.*get)().world();
}

constexpr std::array kinds{
    Kind{Message::kHello, Role::none, nullptr},
    // A part may do what its whole may, which is looked at when it has come.
    Kind{Message::kPart, Role::view, nullptr},
    Kind{Message::kPing, Role::view, nullptr},
    Kind{Message::kPong, Role::view, nullptr},
    // The worlds of the grant alone.
    Kind{Message::kListWorlds, Role::view, nullptr},
    Kind{Message::kSubscribe, Role::view, named_in<&Message::subscribe>},
    // Of one of the session's own streams.
    Kind{Message::kUnsubscribe, Role::view, nullptr},
    Kind{Message::kRequestKey, Role::view, nullptr},
    Kind{Message::kGetStats, Role::view, named_in<&Message::get_stats>, true},
    Kind{Message::kGetScene, Role::view, named_in<&Message::get_scene>, true},
    Kind{Message::kGetState, Role::view, named_in<&Message::get_state>, true},
    Kind{Message::kRaycast, Role::view, named_in<&Message::raycast>, true},
    Kind{Message::kNearestPoint, Role::view, named_in<&Message::nearest_point>, true},
    Kind{Message::kBodiesInBox, Role::view, named_in<&Message::bodies_in_box>, true},
    Kind{Message::kTakeSnapshot, Role::view, named_in<&Message::take_snapshot>, true},
    // Of one that the session took.
    Kind{Message::kReadSnapshot, Role::view, nullptr},
    Kind{Message::kEdit, Role::edit, named_in<&Message::edit>},
    Kind{Message::kImpulse, Role::edit, named_in<&Message::impulse>},
    Kind{Message::kGrab, Role::edit, named_in<&Message::grab>},
    Kind{Message::kMoveGrab, Role::edit, named_in<&Message::move_grab>},
    Kind{Message::kReleaseGrab, Role::edit, named_in<&Message::release_grab>},
    Kind{Message::kPause, Role::edit, named_in<&Message::pause>},
    Kind{Message::kResume, Role::edit, named_in<&Message::resume>},
    Kind{Message::kSetState, Role::edit, named_in<&Message::set_state>},
    Kind{Message::kStep, Role::edit, named_in<&Message::step>},
    Kind{Message::kStepUntil, Role::edit, named_in<&Message::step_until>},
    Kind{Message::kReset, Role::edit, named_in<&Message::reset>},
    Kind{Message::kSeek, Role::edit, named_in<&Message::seek>},
    Kind{Message::kRewindWorld, Role::edit, named_in<&Message::rewind_world>},
    Kind{Message::kCreateWorld, Role::admin, nullptr},
    Kind{Message::kRestoreWorld, Role::admin, nullptr},
    Kind{Message::kBranchWorld, Role::admin, named_in<&Message::branch_world>},
    Kind{Message::kDestroyWorld, Role::admin, named_in<&Message::destroy_world>},
};

const Kind* find_kind(Message::RequestCase request) {
  const auto* found = std::ranges::find(kinds, request, &Kind::request);
  return found == kinds.end() ? nullptr : found;
}

}  // namespace

Role role_for(Message::RequestCase request) {
  const Kind* kind = find_kind(request);
  return kind == nullptr ? Role::admin : kind->role;
}

bool looks_at_bodies(Message::RequestCase request) {
  const Kind* kind = find_kind(request);
  return kind != nullptr && kind->looks_at_bodies;
}

const std::string* world_of(const Message& request) {
  const Kind* kind = find_kind(request.request_case());
  return kind == nullptr || kind->world == nullptr ? nullptr : kind->world(request);
}

Denial check_role(const Grant& grant, Message::RequestCase request) {
  const Role needed = role_for(request);
  if (grant.role >= needed) return std::nullopt;
  return denied(
      "asks for the role " + std::string(name_of(needed)) + "; this token's is " + std::string(name_of(grant.role)),
      std::string(kind_of(request)));
}

Denial check_permission(const Grant& grant, const Message& request) {
  if (Denial denial = check_role(grant, request.request_case())) return denial;
  const std::string* world = world_of(request);
  return world == nullptr ? std::nullopt : check_world(grant, *world, std::string(kind_of(request)) + ".world");
}

}  // namespace pneuma::app
