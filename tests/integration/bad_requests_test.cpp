// Shows that every bad request is answered with its code and the field or name at fault, that the connection stays
// open, and that another client's session and world go on untouched.
#include <cmath>
#include <limits>
#include <vector>

#include "served.h"

namespace pneuma::integration {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

struct BadRequest {
  std::string name;
  v1::ClientMessage message;
  v1::Error::Code code;
  std::string says;  // in where or what
};

class BadRequests : public Served {
 protected:
  void SetUp() override { start(); }

  template <class Fill>
  void add(const std::string& name, v1::Error::Code code, const std::string& says, Fill fill) {
    BadRequest bad{name, {}, code, says};
    fill(bad.message);
    bad_.push_back(std::move(bad));
  }
  void add_impulses();
  void add_edits();
  void add_creations();
  void add_others();

  std::vector<BadRequest> bad_;
};

void BadRequests::add_impulses() {
  const auto impulse = [](v1::ClientMessage& message) -> v1::Impulse& {
    message.mutable_impulse()->set_world("w");
    message.mutable_impulse()->set_body("left");
    return *message.mutable_impulse();
  };
  using M = v1::ClientMessage;
  add("impulse nan", v1::Error::INVALID_ARGUMENT, "impulse.impulse.x: is not finite",
      [&](M& m) { *impulse(m).mutable_impulse() = vec(nan, 0, 0); });
  add("impulse infinite", v1::Error::INVALID_ARGUMENT, "impulse.impulse.z",
      [&](M& m) { *impulse(m).mutable_impulse() = vec(0, 0, -infinity); });
  add("impulse absurd", v1::Error::LIMIT_EXCEEDED, "impulse.impulse.y: is 1e+200; its magnitude may be at most 1e+09",
      [&](M& m) { *impulse(m).mutable_impulse() = vec(0, 1e200, 0); });
  add("impulse unknown body", v1::Error::NOT_FOUND, "impulse.body: no body is named \"nobody\"",
      [&](M& m) { impulse(m).set_body("nobody"); });
  add("impulse no body", v1::Error::INVALID_ARGUMENT, "impulse.body", [&](M& m) { impulse(m).set_body(""); });
  add("impulse vertex", v1::Error::INVALID_ARGUMENT, "impulse.vertex: \"left\" has 162 vertices",
      [&](M& m) { impulse(m).set_vertex(162); });
  add("impulse near nan", v1::Error::INVALID_ARGUMENT, "impulse.near.position.y",
      [&](M& m) { *impulse(m).mutable_near()->mutable_position() = vec(0, nan, 0); });
  add("impulse near radius", v1::Error::INVALID_ARGUMENT, "impulse.near.radius_m",
      [&](M& m) { impulse(m).mutable_near()->set_radius_m(-1.0); });
  add("impulse ray without direction", v1::Error::INVALID_ARGUMENT, "impulse.ray.direction",
      [&](M& m) { impulse(m).mutable_ray(); });
  add("impulse ray misses", v1::Error::NOT_FOUND, "impulse.ray", [&](M& m) {
    *impulse(m).mutable_ray()->mutable_origin() = vec(0, 100, 0);
    *impulse(m).mutable_ray()->mutable_direction() = vec(0, 1, 0);
  });
  add("impulse unknown world", v1::Error::NOT_FOUND, "nowhere", [&](M& m) { impulse(m).set_world("nowhere"); });
  add("grab nothing", v1::Error::INVALID_ARGUMENT, "grab.at", [](M& m) {
    m.mutable_grab()->set_world("w");
    m.mutable_grab()->set_body("left");
  });
  add("grab target", v1::Error::INVALID_ARGUMENT, "grab.target.x", [&](M& m) {
    m.mutable_grab()->set_world("w");
    m.mutable_grab()->set_body("left");
    m.mutable_grab()->set_vertex(0);
    *m.mutable_grab()->mutable_target() = vec(infinity, 0, 0);
  });
  add("grab stiffness", v1::Error::INVALID_ARGUMENT, "grab.stiffness_n_m", [&](M& m) {
    m.mutable_grab()->set_world("w");
    m.mutable_grab()->set_body("left");
    m.mutable_grab()->set_vertex(0);
    m.mutable_grab()->set_stiffness_n_m(-1.0);
  });
  add("grab radius", v1::Error::INVALID_ARGUMENT, "grab.radius_m", [&](M& m) {
    m.mutable_grab()->set_world("w");
    m.mutable_grab()->set_body("left");
    m.mutable_grab()->set_vertex(0);
    m.mutable_grab()->set_radius_m(-1.0);
  });
  add("move no grab", v1::Error::NOT_FOUND, "77", [](M& m) {
    m.mutable_move_grab()->set_world("w");
    m.mutable_move_grab()->set_grab_id(77);
  });
  add("release no grab", v1::Error::NOT_FOUND, "77", [](M& m) {
    m.mutable_release_grab()->set_world("w");
    m.mutable_release_grab()->set_grab_id(77);
  });
}

void BadRequests::add_edits() {
  using M = v1::ClientMessage;
  const auto change = [](M& message) -> v1::SceneChange& {
    message.mutable_edit()->set_world("w");
    return *message.mutable_edit()->mutable_edit()->add_changes();
  };
  add("edit nothing", v1::Error::INVALID_ARGUMENT, "edit.source", [](M& m) { m.mutable_edit()->set_world("w"); });
  add("edit json", v1::Error::INVALID_ARGUMENT, "edit.edit_json.line 1, column 2", [](M& m) {
    m.mutable_edit()->set_world("w");
    m.mutable_edit()->set_edit_json("{]");
  });
  add("edit json unknown field", v1::Error::INVALID_ARGUMENT,
      "edit.edit_json.changes[0].remove_everything: ", [](M& m) {
        m.mutable_edit()->set_world("w");
        m.mutable_edit()->set_edit_json(R"({"changes": [{"remove_everything": true}]})");
      });
  add("edit empty change", v1::Error::INVALID_ARGUMENT, "edit.edit.changes[0]: ", [&](M& m) { change(m); });
  add("edit unknown body", v1::Error::NOT_FOUND,
      "edit.edit.changes[0].remove_soft_body: ", [&](M& m) { change(m).set_remove_soft_body("nobody"); });
  add("edit taken name", v1::Error::ALREADY_EXISTS, "edit.edit.changes[0].add_soft_body.name: \"left\"",
      [&](M& m) { *change(m).mutable_add_soft_body() = two_balls().soft_bodies(0); });
  add("edit missing mesh", v1::Error::NOT_FOUND,
      "edit.edit.changes[0].add_soft_body.mesh: no mesh is named \"no-mesh\"", [&](M& m) {
        change(m).mutable_add_soft_body()->set_name("b");
        m.mutable_edit()->mutable_edit()->mutable_changes(0)->mutable_add_soft_body()->set_mesh("no-mesh");
      });
  add("edit negative mass", v1::Error::INVALID_ARGUMENT, "edit.edit.changes[0].change_soft_body.mass_kg: is -1",
      [&](M& m) {
        auto& body = *change(m).mutable_change_soft_body();
        body.set_name("left");
        body.set_mass_kg(-1.0);
      });
  add("edit nan gravity", v1::Error::INVALID_ARGUMENT, "edit.edit.changes[0].set_gravity.y: is not finite",
      [&](M& m) { *change(m).mutable_set_gravity() = vec(0, nan, 0); });
  add("edit pin out of range", v1::Error::INVALID_ARGUMENT,
      "edit.edit.changes[0].change_soft_body.pins.vertices[0]: names vertex 100000", [&](M& m) {
        auto& body = *change(m).mutable_change_soft_body();
        body.set_name("left");
        body.mutable_pins()->add_vertices(100'000);
      });
  add("edit too fast a world", v1::Error::LIMIT_EXCEEDED, "edit.edit.changes[0].set_stepping.rate_hz: is 5000",
      [&](M& m) { change(m).mutable_set_stepping()->set_rate_hz(5000.0); });
  add("edit json of a bad gas", v1::Error::INVALID_ARGUMENT,
      "edit.edit_json.changes[0].change_soft_body.gas.moles: ", [](M& m) {
        m.mutable_edit()->set_world("w");
        m.mutable_edit()->set_edit_json(
            R"({"changes": [{"change_soft_body": {"name": "right", "gas": {"moles": -2}}}]})");
      });
  add("edit second change bad", v1::Error::NOT_FOUND, "edit.edit.changes[1].remove_soft_body", [&](M& m) {
    change(m).set_remove_soft_body("left");
    change(m).set_remove_soft_body("nobody");
  });
}

void BadRequests::add_creations() {
  using M = v1::ClientMessage;
  add("create nothing", v1::Error::INVALID_ARGUMENT, "create_world.source", [](M& m) { m.mutable_create_world(); });
  add("create long name", v1::Error::LIMIT_EXCEEDED, "create_world.name: has 129 bytes; at most 128", [](M& m) {
    m.mutable_create_world()->set_name(std::string(129, 'w'));
    m.mutable_create_world()->set_builtin("bouncing-ball");
  });
  add("create json missing mesh", v1::Error::NOT_FOUND, "create_world.scene_json.soft_bodies[0].mesh: ", [](M& m) {
    m.mutable_create_world()->set_scene_json(R"({"soft_bodies": [{"name": "b", "mesh": "none"}]})");
  });
  add("create unknown built-in", v1::Error::NOT_FOUND, "no-such-scene",
      [](M& m) { m.mutable_create_world()->set_builtin("no-such-scene"); });
  add("create a server's file", v1::Error::NOT_FOUND, "passwd",
      [](M& m) { m.mutable_create_world()->set_builtin("/etc/passwd"); });
  add("create taken name", v1::Error::ALREADY_EXISTS, "create_world.name: there is a world w", [](M& m) {
    m.mutable_create_world()->set_name("w");
    m.mutable_create_world()->set_builtin("bouncing-ball");
  });
  add("create bad name", v1::Error::INVALID_ARGUMENT, "create_world.name", [](M& m) {
    m.mutable_create_world()->set_name("../../etc");
    m.mutable_create_world()->set_builtin("bouncing-ball");
  });
  add("create json typo", v1::Error::INVALID_ARGUMENT, "create_world.scene_json.gravty: ", [](M& m) {
    m.mutable_create_world()->set_scene_json(R"({"gravty": {"y": 1}})");
  });
  add("create open mesh with gas", v1::Error::INVALID_ARGUMENT, "create_world.scene.soft_bodies[0].mesh: gas needs",
      [](M& m) {
        v1::Scene& scene = *m.mutable_create_world()->mutable_scene();
        scene = two_balls();
        scene.mutable_meshes(0)->mutable_grid()->set_columns(4);
        scene.mutable_meshes(0)->mutable_grid()->set_rows(4);
      });
  add("create index out of range", v1::Error::INVALID_ARGUMENT,
      "create_world.scene.meshes[0].triangles.indices[0..2]: ", [](M& m) {
        v1::Scene& scene = *m.mutable_create_world()->mutable_scene();
        scene = two_balls();
        auto& triangles = *scene.mutable_meshes(0)->mutable_triangles();
        for (int i = 0; i < 3; ++i) *triangles.add_positions() = vec(i, i * i, 0);
        for (const std::uint32_t index : {0U, 1U, 7U}) triangles.add_indices(index);
      });
  add("create zero-area face", v1::Error::INVALID_ARGUMENT,
      "create_world.scene.meshes[0].triangles.indices[0..2]: ", [](M& m) {
        v1::Scene& scene = *m.mutable_create_world()->mutable_scene();
        scene = two_balls();
        auto& triangles = *scene.mutable_meshes(0)->mutable_triangles();
        for (int i = 0; i < 3; ++i) *triangles.add_positions() = vec(i, 0, 0);
        for (const std::uint32_t index : {0U, 1U, 2U}) triangles.add_indices(index);
      });
  add("create huge mesh", v1::Error::LIMIT_EXCEEDED, "create_world.scene.meshes[0].icosphere", [](M& m) {
    v1::Scene& scene = *m.mutable_create_world()->mutable_scene();
    scene = two_balls();
    scene.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(4'000'000'000U);
  });
  add("create bad rate", v1::Error::INVALID_ARGUMENT, "create_world.scene.stepping.rate_hz: is not finite", [](M& m) {
    v1::Scene& scene = *m.mutable_create_world()->mutable_scene();
    scene = two_balls();
    scene.mutable_stepping()->set_rate_hz(nan);
  });
}

void BadRequests::add_others() {
  using M = v1::ClientMessage;
  add("subscribe nowhere", v1::Error::NOT_FOUND, "nowhere", [](M& m) { m.mutable_subscribe()->set_world("nowhere"); });
  add("subscribe rate", v1::Error::INVALID_ARGUMENT, "subscribe.rate_hz", [](M& m) {
    m.mutable_subscribe()->set_world("w");
    m.mutable_subscribe()->set_rate_hz(-5.0);
  });
  add("subscribe error", v1::Error::LIMIT_EXCEEDED, "subscribe.max_error_m: is 1e-12; must be 0 or from 1e-06 to 10",
      [](M& m) {
        m.mutable_subscribe()->set_world("w");
        m.mutable_subscribe()->set_max_error_m(1e-12);
      });
  add("unsubscribe nothing", v1::Error::NOT_FOUND, "4242", [](M& m) { m.mutable_unsubscribe()->set_stream_id(4242); });
  add("destroy nowhere", v1::Error::NOT_FOUND, "nowhere",
      [](M& m) { m.mutable_destroy_world()->set_world("nowhere"); });
  add("stats nowhere", v1::Error::NOT_FOUND, "nowhere", [](M& m) { m.mutable_get_stats()->set_world("nowhere"); });
  add("scene nowhere", v1::Error::NOT_FOUND, "nowhere", [](M& m) { m.mutable_get_scene()->set_world("nowhere"); });
  add("pause nowhere", v1::Error::NOT_FOUND, "nowhere", [](M& m) { m.mutable_pause()->set_world("nowhere"); });
  add("resume nowhere", v1::Error::NOT_FOUND, "nowhere", [](M& m) { m.mutable_resume()->set_world("nowhere"); });
  add("reset nowhere", v1::Error::NOT_FOUND, "nowhere", [](M& m) { m.mutable_reset()->set_world("nowhere"); });
  add("step nowhere", v1::Error::NOT_FOUND, "nowhere", [](M& m) { m.mutable_step()->set_world("nowhere"); });
  add("snapshot nowhere", v1::Error::NOT_FOUND, "nowhere",
      [](M& m) { m.mutable_take_snapshot()->set_world("nowhere"); });
  add("piece of no snapshot", v1::Error::NOT_FOUND, "read_snapshot.snapshot_id",
      [](M& m) { m.mutable_read_snapshot()->set_snapshot_id(9); });
  add("restore no file", v1::Error::INVALID_ARGUMENT, "restore_world.snapshot: is no world file",
      [](M& m) { m.mutable_restore_world()->set_snapshot("{}"); });
  add("branch to a bad name", v1::Error::INVALID_ARGUMENT, "branch_world.name", [](M& m) {
    m.mutable_branch_world()->set_world("w");
    m.mutable_branch_world()->set_name("a b");
  });
  add("branch of what was not kept", v1::Error::FAILED_PRECONDITION, "branch_world.tick", [](M& m) {
    m.mutable_branch_world()->set_world("w");
    m.mutable_branch_world()->set_tick(0);
  });
  add("rewind to what is to come", v1::Error::INVALID_ARGUMENT, "rewind_world.tick", [](M& m) {
    m.mutable_rewind_world()->set_world("w");
    m.mutable_rewind_world()->set_tick(1'000'000);
  });
  add("rewind to a state of its own", v1::Error::INVALID_ARGUMENT, "rewind_world.state", [](M& m) {
    m.mutable_rewind_world()->set_world("w");
    m.mutable_rewind_world()->set_state("state");
  });
  add("key of no stream", v1::Error::NOT_FOUND, "request_key.stream_id",
      [](M& m) { m.mutable_request_key()->set_stream_id(77); });
  add("step nothing", v1::Error::INVALID_ARGUMENT, "step.ticks", [](M& m) { m.mutable_step()->set_world("w"); });
  add("step too far", v1::Error::LIMIT_EXCEEDED, "step.ticks", [](M& m) {
    m.mutable_step()->set_world("w");
    m.mutable_step()->set_ticks(4'000'000'000U);
  });
  add("step a running world", v1::Error::FAILED_PRECONDITION, "pause", [](M& m) {
    m.mutable_step()->set_world("running");
    m.mutable_step()->set_ticks(1);
  });
  add("second hello", v1::Error::FAILED_PRECONDITION, "hello",
      [](M& m) { m.mutable_hello()->set_protocol_version(1); });
  add("no request", v1::Error::UNSUPPORTED, "no request that this server knows", [](M&) {});
}

/// The request's field in ClientMessage: where every path of its errors begins.
std::string kind_of(const v1::ClientMessage& message) {
  const auto* field = v1::ClientMessage::descriptor()->FindFieldByNumber(static_cast<int>(message.request_case()));
  return field == nullptr ? std::string() : field->name();
}

TEST_F(BadRequests, EachIsAnsweredByNameAndNothingElseHappens) {
  client::Client watcher = connect();
  create(watcher, two_balls(), "w", true);
  create(watcher, two_balls(), "running");
  const auto hash = watcher.stats("w")->state_hash();
  ASSERT_TRUE(watcher.subscribe("running").ok());

  add_impulses();
  add_edits();
  add_creations();
  add_others();
  client::Client client = connect();
  for (const BadRequest& bad : bad_) {
    SCOPED_TRACE(bad.name);
    const auto reply = client.call(bad.message);
    ASSERT_FALSE(reply.ok());
    EXPECT_EQ(static_cast<int>(reply.status().code()), static_cast<int>(bad.code)) << reply.status().message();
    EXPECT_NE(reply.status().message().find(bad.says), std::string::npos) << reply.status().message();
    const std::string& where = reply.status().where();
    EXPECT_TRUE(where.empty() || where == server_->tcp_address() || where == kind_of(bad.message) ||
                where.starts_with(kind_of(bad.message) + "."))
        << where;
    ASSERT_TRUE(client.ping().ok()) << "the connection is gone after: " << reply.status().message();
  }

  EXPECT_EQ(watcher.stats("w")->state_hash(), hash);
  EXPECT_EQ(watcher.list_worlds()->worlds_size(), 2);
  const auto tick = watcher.stats("running")->tick();
  EXPECT_TRUE(await_frame(watcher, [&](const auto& frame) { return frame.tick > tick; }));
  EXPECT_TRUE(server_->is_running());
}

}  // namespace
}  // namespace pneuma::integration
