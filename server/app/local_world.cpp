#include "app/local_world.h"

#include <string>
#include <utility>

#include "app/protocol.h"
#include "app/request_kinds.h"
#include "app/step_goal.h"
#include "app/world_queries.h"
#include "app/world_state.h"
#include "app/world_stats.h"
#include "base/limits.h"

namespace pneuma::app {

using base::Result;
using base::Status;

LocalWorld::LocalWorld(LiveWorld live, std::size_t threads)
    : live_(std::move(live)), workers_(std::make_unique<physics::Workers>(threads)) {}

Result<LocalWorld> LocalWorld::create(v1::Scene scene, std::size_t threads) {
  Result<LiveWorld> live = LiveWorld::create(std::move(scene));
  if (!live.ok()) return live.status();
  return LocalWorld(std::move(*live), threads);
}

v1::ServerMessage LocalWorld::answer(const v1::ClientMessage& request) {
  Result<v1::ServerMessage> reply = try_to_answer(request);
  return reply.ok() ? std::move(*reply) : error_reply(request.request_id(), reply.status());
}

Result<v1::ServerMessage> LocalWorld::try_to_answer(const v1::ClientMessage& request) {
  const std::string* named = world_of(request);
  if (named != nullptr && !named->empty() && *named != live_.scene_name()) {
    return base::not_found("no world " + *named + " in here; it is called " + live_.scene_name(),
                           std::string(kind_of(request)) + ".world");
  }
  if (auto answer = answer_question(live_.physics(), request, live_.scene_name(), live_.tick())) return *answer;
  v1::ServerMessage reply;
  reply.set_request_id(request.request_id());
  switch (request.request_case()) {
    case v1::ClientMessage::kStep:
    case v1::ClientMessage::kStepUntil:
      return step(request);
    case v1::ClientMessage::kGetScene:
      *reply.mutable_scene()->mutable_scene() = live_.scene();
      reply.mutable_scene()->set_tick(live_.tick());
      return reply;
    case v1::ClientMessage::kGetStats:
      describe(live_.physics(), *reply.mutable_stats());
      reply.mutable_stats()->set_world(live_.scene_name());
      reply.mutable_stats()->set_tick(live_.tick());
      return reply;
    default:
      return change(request);
  }
}

Result<v1::ServerMessage> LocalWorld::step(const v1::ClientMessage& request) {
  const bool until = request.has_step_until();
  const std::string kind(kind_of(request));
  const std::uint32_t ticks = until ? request.step_until().ticks_max() : request.step().ticks();
  const v1::Observe& asked = until ? request.step_until().observe() : request.step().observe();
  if (ticks == 0) return base::invalid("must be 1 or more", kind + (until ? ".ticks_max" : ".ticks"));
  if (until) {
    if (Status wrong = check_goal(live_.physics(), request.step_until()); !wrong.ok()) return wrong;
  }
  if (Status wrong = check_observed(live_.physics(), asked); !wrong.ok()) return wrong.inside(kind + ".observe");

  physics::World& world = live_.physics();
  world.note_contacts(until && request.step_until().has_touch());
  bool reached = until && request.step_until().has_tick() && request.step_until().tick() <= live_.tick();
  for (std::uint32_t done = 0; done < ticks && !reached; ++done) {
    world.step_tick(*workers_);
    reached = until && is_reached(world, live_.tick(), request.step_until());
  }
  // Nobody asks what happened; what the bodies became shows in the state.
  (void)world.take_frozen();
  (void)world.take_gas_events();
  (void)world.take_broken_joints();
  v1::ServerMessage reply = done_reply(request.request_id(), live_.tick(), live_.scene_name());
  if (until) reply.mutable_done()->set_reached(reached);
  if (until ? request.step_until().has_observe() : request.step().has_observe()) {
    *reply.mutable_done()->mutable_state() = state_of(live_.physics(), asked, live_.scene_name(), live_.tick());
  }
  return reply;
}

Result<v1::ServerMessage> LocalWorld::change(const v1::ClientMessage& request) {
  if (!LiveWorld::is_change(request)) {
    return Status(base::StatusCode::unsupported, "takes a server", std::string(kind_of(request)));
  }
  auto effect = live_.change(request);
  if (!effect.ok()) return effect.status();
  // An edit shows at once, anything else with the next tick.
  const std::uint64_t shown_from = effect->edited ? live_.tick() : live_.tick() + 1;
  if (!effect->grabbed) {
    return done_reply(request.request_id(), shown_from, live_.scene_name(), effect->detail, effect->mended);
  }
  v1::ServerMessage reply;
  reply.set_request_id(request.request_id());
  *reply.mutable_grabbed() = *effect->grabbed;
  reply.mutable_grabbed()->set_tick(shown_from);
  return reply;
}

}  // namespace pneuma::app
