// Shows what a stream holds for who asks for it: some bodies, coarser meshes, velocities, scalars; that whoever asks
// for the same shares a class; and that a stream waits for a mesh that is still being made. A real world and the
// client's own decoder, no sockets.
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <optional>
#include <set>

#include <gtest/gtest.h>

#include "app/frame_contacts.h"
#include "app/frame_hub.h"
#include "app/live_world.h"
#include "app/stream_terms.h"
#include "ball_scene.h"
#include "base/limits.h"
#include "pneuma_client/frames.h"
#include "scene_io/translate.h"
#include "viewer.h"

namespace pneuma::app {
namespace {

constexpr double max_error_m = 1e-4;

v1::ClientMessage remove_ball(const std::string& name) {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_edit()->set_world("w");
  message.mutable_edit()->mutable_edit()->add_changes()->set_remove_soft_body(name);
  return message;
}

/// A world of which is counted how often its bodies are measured, and whose contacts may be made up.
class CountedMeasures final : public FrameSource {
 public:
  explicit CountedMeasures(const physics::World& world) : live_(world) {}
  [[nodiscard]] int count() const { return count_; }
  /// The first vertices of each body touch a solid, so many of them.
  void touch(std::size_t vertices) {
    touched_.resize(vertices);
    for (std::uint32_t i = 0; i < vertices; ++i) touched_[i].vertex = i;
  }

  [[nodiscard]] double time_s() const override { return live_.time_s(); }
  [[nodiscard]] double tick_period_s() const override { return live_.tick_period_s(); }
  [[nodiscard]] std::size_t soft_body_count() const override { return live_.soft_body_count(); }
  [[nodiscard]] const std::string& soft_body_name(std::size_t index) const override {
    return live_.soft_body_name(index);
  }
  [[nodiscard]] std::shared_ptr<const physics::Mesh> mesh(std::size_t index) const override {
    return live_.mesh(index);
  }
  void copy_positions(std::size_t index, std::span<double> out_m) const override { live_.copy_positions(index, out_m); }
  [[nodiscard]] const std::vector<std::uint32_t>& kept_vertices(std::size_t index) const override {
    return live_.kept_vertices(index);
  }
  [[nodiscard]] bool has_velocities() const override { return true; }
  void copy_velocities(std::size_t index, std::span<double> out_m_s) const override {
    live_.copy_velocities(index, out_m_s);
  }
  [[nodiscard]] bool has_scalars() const override { return true; }
  [[nodiscard]] BodyScalars scalars(std::size_t index) const override {
    ++count_;
    return live_.scalars(index);
  }
  [[nodiscard]] bool has_contacts() const override { return true; }
  [[nodiscard]] std::vector<TouchedVertex> contacts(std::size_t) const override { return touched_; }
  void describe_solids(v1::Layout& layout) const override { live_.describe_solids(layout); }
  [[nodiscard]] std::vector<physics::Pose> poses() const override { return live_.poses(); }

 private:
  LiveFrames live_;
  std::vector<TouchedVertex> touched_;
  mutable int count_ = 0;
};

/// A subscriber with its decoder.
struct Watcher {
  explicit Watcher(net::SessionId id) : viewer(id) {}

  Viewer viewer;
  client::StreamDecoder decoder;
  v1::Subscribed subscribed;
  std::vector<v1::Layout> layouts;
  std::size_t topologies = 0;
};

class StreamContents : public testing::Test {
 protected:
  StreamContents()
      : world_(std::move(*LiveWorld::create(ball_scene()))),
        hub_([this] { return ++last_stream_id_; }, [](std::uint32_t) {},
             [this](std::size_t /*vertices*/, std::function<void()> make) { deferred_ = std::move(make); }) {}

  void change(const v1::ClientMessage& message) {
    ASSERT_TRUE(world_.change(message).ok());
    hub_.edited();
  }

  [[nodiscard]] base::Status check(const v1::Subscribe& request) const {
    return check_subscribed(request, LiveFrames(world_.physics()));
  }

  void subscribe(Watcher& watcher, v1::Subscribe request) {
    request.set_world("w");
    request.set_max_error_m(max_error_m);
    ASSERT_TRUE(check(request).ok());
    const auto subscribed = hub_.subscribe(watcher.viewer.session(), request, 60.0);
    ASSERT_TRUE(subscribed.ok()) << subscribed.status().message();
    watcher.subscribed = *subscribed;
    ASSERT_TRUE(watcher.decoder.add_stream(*subscribed).ok());
  }

  /// Makes what was deferred; false where nothing was.
  bool make_deferred() {
    const auto make = std::exchange(deferred_, nullptr);
    if (make) make();
    return make != nullptr;
  }

  Outbox tick() {
    world_.physics().note_contacts(hub_.wants_contacts());
    world_.physics().step_tick(workers_);
    Outbox outbox;
    hub_.encode_tick(LiveFrames(world_.physics()), world_.tick(), false, outbox);
    return outbox;
  }

  /// What the watcher has of it: its last frame, if there is one.
  static std::optional<client::DecodedFrame> see(Watcher& watcher, const Outbox& outbox) {
    std::optional<client::DecodedFrame> last;
    for (const std::string& bytes : watcher.viewer.take(outbox)) {
      v1::ServerMessage message;
      EXPECT_TRUE(message.ParseFromString(bytes));
      if (message.has_topology()) {
        ++watcher.topologies;
        EXPECT_TRUE(watcher.decoder.take_topology(message.topology()).ok());
      }
      if (message.has_layout()) {
        watcher.layouts.push_back(message.layout());
        EXPECT_TRUE(watcher.decoder.take_layout(message.layout()).ok());
      }
      if (!message.has_frame()) continue;
      auto frame = watcher.decoder.take_frame(message.frame(), bytes.size());
      EXPECT_TRUE(frame.ok()) << frame.status().message();
      if (frame.ok()) last = std::move(*frame);
    }
    return last;
  }

  static std::vector<std::string> names(const client::DecodedFrame& frame) {
    std::vector<std::string> out;
    for (const auto& body : frame.bodies) out.push_back(body.name);
    return out;
  }

  [[nodiscard]] std::vector<double> true_positions(std::size_t body) const {
    std::vector<double> out(3 * world_.physics().soft_body(body).mesh->positions_m.size());
    world_.physics().copy_positions(body, out);
    return out;
  }
  [[nodiscard]] std::vector<double> true_velocities(std::size_t body) const {
    std::vector<double> out(3 * world_.physics().soft_body(body).mesh->positions_m.size());
    world_.physics().copy_velocities(body, out);
    return out;
  }

  static double distance(const double* a, const double* b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

  physics::Workers workers_{1};
  LiveWorld world_;
  std::uint32_t last_stream_id_ = 0;
  std::function<void()> deferred_;
  FrameHub hub_;
  Watcher ann_{1};
  Watcher bob_{2};
};

TEST_F(StreamContents, AFilterShowsItsBodiesAsAllOthersSeeThem) {
  change(add_second_ball());
  subscribe(ann_, {});
  v1::Subscribe request;
  request.add_bodies("second");
  subscribe(bob_, request);
  for (int i = 0; i < 20; ++i) {
    const Outbox outbox = tick();
    const auto all = see(ann_, outbox);
    const auto some = see(bob_, outbox);
    ASSERT_TRUE(all && some);
    EXPECT_EQ(names(*all), (std::vector<std::string>{"ball", "second"}));
    EXPECT_EQ(names(*some), std::vector<std::string>{"second"});
    EXPECT_EQ(some->bodies[0].positions_m, all->bodies[1].positions_m);
    EXPECT_EQ(some->solids.size(), all->solids.size()) << "solids are always shown";
  }
}

TEST_F(StreamContents, AnUnknownBodyIsNotFoundWhereItIsNamed) {
  v1::Subscribe request;
  request.add_bodies("ball");
  request.add_bodies("nobody");
  const base::Status status = check(request);
  EXPECT_EQ(status.code(), base::StatusCode::not_found);
  EXPECT_EQ(status.where(), "subscribe.bodies[1]");
  request.clear_bodies();
  for (std::size_t i = 0; i <= base::world_bodies_max; ++i) request.add_bodies("ball");
  EXPECT_EQ(check(request).code(), base::StatusCode::limit_exceeded);
}

TEST_F(StreamContents, ABodyOfAFilteredNameLeavesAndJoins) {
  change(add_second_ball());
  v1::Subscribe request;
  request.add_bodies("second");
  subscribe(ann_, request);
  EXPECT_EQ(names(*see(ann_, tick())), std::vector<std::string>{"second"});
  change(remove_ball("second"));
  const auto without = see(ann_, tick());
  ASSERT_TRUE(without);
  EXPECT_TRUE(without->bodies.empty());
  EXPECT_TRUE(without->key);
  change(add_second_ball());
  const auto with = see(ann_, tick());
  ASSERT_TRUE(with);
  EXPECT_EQ(names(*with), std::vector<std::string>{"second"});
  EXPECT_EQ(ann_.layouts.size(), 3U);
}

TEST_F(StreamContents, TheSameBodiesInAnyOrderAreOneClass) {
  change(add_second_ball());
  v1::Subscribe request;
  request.add_bodies("second");
  request.add_bodies("ball");
  subscribe(ann_, request);
  request.clear_bodies();
  for (const char* body : {"ball", "second", "ball"}) request.add_bodies(body);
  subscribe(bob_, request);
  EXPECT_EQ(hub_.class_count(), 1U);
  request.set_scalars(true);
  subscribe(bob_, request);
  request.set_velocities(true);
  subscribe(bob_, request);
  request.set_level_of_detail(1);
  subscribe(bob_, request);
  request.clear_bodies();
  subscribe(bob_, request);
  EXPECT_EQ(hub_.class_count(), 5U);
}

TEST_F(StreamContents, ScalarsAreTheWorldsOwnInKeysAndDeltas) {
  v1::Subscribe request;
  request.set_scalars(true);
  subscribe(ann_, request);
  subscribe(bob_, {});
  for (int i = 0; i < 5; ++i) {
    const Outbox outbox = tick();
    const auto frame = see(ann_, outbox);
    ASSERT_TRUE(frame && frame->has_scalars);
    const auto measures = world_.physics().measure(0);
    EXPECT_FLOAT_EQ(static_cast<float>(frame->bodies[0].scalars.volume_m3), static_cast<float>(measures.volume_m3));
    EXPECT_FLOAT_EQ(static_cast<float>(frame->bodies[0].scalars.pressure_pa), static_cast<float>(measures.pressure_pa));
    EXPECT_FLOAT_EQ(static_cast<float>(frame->bodies[0].scalars.kinetic_j), static_cast<float>(measures.kinetic_j));
    EXPECT_FLOAT_EQ(static_cast<float>(frame->bodies[0].scalars.elastic_j), static_cast<float>(measures.elastic_j));
    EXPECT_FALSE(frame->bodies[0].scalars.asleep);
    const auto plain = see(bob_, outbox);
    ASSERT_TRUE(plain);
    EXPECT_FALSE(plain->has_scalars);
  }
}

TEST_F(StreamContents, ContactsAreTheWorldsOwnInKeysAndDeltas) {
  v1::Subscribe request;
  request.set_contacts(true);
  subscribe(ann_, request);
  subscribe(bob_, {});
  EXPECT_EQ(hub_.class_count(), 2U);
  std::size_t told = 0;
  for (int i = 0; i < 60; ++i) {
    const Outbox outbox = tick();
    const auto frame = see(ann_, outbox);
    ASSERT_TRUE(frame);
    const physics::ContactNotes notes = world_.physics().contacts(0);
    ASSERT_EQ(frame->contacts.size(), notes.size());
    for (std::size_t n = 0; n < notes.size(); ++n, ++told) {
      const client::ContactFrame& contact = frame->contacts[n];
      EXPECT_EQ(frame->bodies[contact.body].name, "ball");
      EXPECT_EQ(contact.vertex, notes[n].vertex);
      ASSERT_TRUE(contact.other_solid);
      EXPECT_EQ(frame->solids[*contact.other_solid].name, "floor");
      EXPECT_EQ(contact.normal[1], 1.0);
    }
    const auto plain = see(bob_, outbox);
    ASSERT_TRUE(plain);
    EXPECT_TRUE(plain->contacts.empty());
  }
  EXPECT_GT(told, 0U) << "it fell onto the floor";
  Outbox outbox;
  ASSERT_TRUE(hub_.unsubscribe(ann_.viewer.session()->id(), ann_.subscribed.stream_id(), outbox));
  (void)tick();
  EXPECT_TRUE(world_.physics().contacts(0).empty()) << "nobody asks any more";
}

TEST_F(StreamContents, OfTooManyContactsASpreadChoiceIsToldThatStaysTheSame) {
  WorldLayout layout(View(), {});
  MeshTopologies topologies([](std::size_t /*vertices*/, const auto& make) { make(); });
  CountedMeasures source(world_.physics());
  ASSERT_EQ(layout.update(source, topologies, 0), WorldLayout::Update::changed);
  const auto told = [&](std::size_t touched) {
    source.touch(touched);
    std::set<std::uint32_t> vertices;
    for (const v1::Contact& contact : contacts_of(source, layout)) vertices.insert(contact.vertex());
    return vertices;
  };
  EXPECT_EQ(told(base::frame_contacts_max).size(), base::frame_contacts_max);
  const auto of_many = told(10'000);
  ASSERT_EQ(of_many.size(), base::frame_contacts_max);
  const auto of_more = told(10'100);
  std::vector<std::uint32_t> both;
  std::ranges::set_intersection(of_many, of_more, std::back_inserter(both));
  EXPECT_GT(both.size(), base::frame_contacts_max * 9 / 10);
  std::vector<std::uint32_t> ends(of_many.begin(), of_many.end());
  ends.insert(ends.begin(), 0);
  ends.push_back(10'000);
  for (std::size_t i = 1; i < ends.size(); ++i) {
    EXPECT_LT(ends[i] - ends[i - 1], 5U * 10'000U / base::frame_contacts_max) << "no large part is left out";
  }
}

TEST_F(StreamContents, ABodyIsMeasuredOnceATickForAllWhoAskAndNotForOthers) {
  change(add_second_ball());
  const CountedMeasures source(world_.physics());
  const auto measured = [&](std::uint64_t tick) {
    const int before = source.count();
    Outbox outbox;
    hub_.encode_tick(source, tick, false, outbox);
    return source.count() - before;
  };
  subscribe(ann_, {});
  EXPECT_EQ(measured(1), 0);
  v1::Subscribe request;
  request.set_scalars(true);
  request.add_bodies("ball");
  subscribe(ann_, request);
  EXPECT_EQ(measured(2), 1);
  request.set_velocities(true);
  subscribe(bob_, request);
  EXPECT_EQ(measured(3), 1);
  request.clear_bodies();
  subscribe(bob_, request);
  EXPECT_EQ(measured(4), 2);
}

TEST_F(StreamContents, VelocitiesAreWithinTheBoundThatIsDeclared) {
  v1::Subscribe request;
  request.set_rate_hz(30.0);
  request.set_velocities(true);
  subscribe(ann_, request);
  EXPECT_DOUBLE_EQ(ann_.subscribed.max_velocity_error_m_s(), 30.0 * max_error_m);
  int frames = 0;
  for (int i = 0; i < 120; ++i) {
    const auto frame = see(ann_, tick());
    if (!frame) continue;
    ++frames;
    const std::vector<double> true_m_s = true_velocities(0);
    const std::vector<double>& seen_m_s = frame->bodies[0].velocities_m_s;
    ASSERT_EQ(seen_m_s.size(), true_m_s.size());
    for (std::size_t at = 0; at < true_m_s.size(); at += 3) {
      ASSERT_LE(distance(&seen_m_s[at], &true_m_s[at]), ann_.subscribed.max_velocity_error_m_s()) << "frame " << i;
    }
  }
  EXPECT_GE(frames, 60);
}

TEST_F(StreamContents, TheVelocityBoundStaysWhereACodecCanKeepIt) {
  v1::Subscribe request;
  request.set_velocities(true);
  request.set_rate_hz(1e-3);
  request.set_max_error_m(base::max_error_min_m);
  EXPECT_EQ(hub_.subscribe(ann_.viewer.session(), request, 60.0)->max_velocity_error_m_s(), base::max_error_min_m);
  request.set_rate_hz(0.0);
  request.set_max_error_m(base::max_error_max_m);
  EXPECT_EQ(hub_.subscribe(ann_.viewer.session(), request, 60.0)->max_velocity_error_m_s(), base::max_error_max_m);
}

TEST_F(StreamContents, ALevelShowsTheKeptVerticesWhereTheyAre) {
  v1::Subscribe request;
  request.set_level_of_detail(1);
  request.set_velocities(true);
  subscribe(ann_, request);
  EXPECT_FALSE(see(ann_, tick())) << "the mesh is not there yet";
  EXPECT_TRUE(ann_.layouts.empty());
  ASSERT_TRUE(make_deferred());
  for (int i = 0; i < 30; ++i) {
    const auto frame = see(ann_, tick());
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->key, i == 0);
    const client::SoftBodyFrame& body = frame->bodies[0];
    ASSERT_EQ(body.kept_vertices->size(), 12U);  // a quarter of 42 is less than the least
    ASSERT_EQ(body.positions_m.size(), 36U);
    const std::vector<double> true_m = true_positions(0);
    const std::vector<double> true_m_s = true_velocities(0);
    for (std::size_t at = 0; at < 12; ++at) {
      const std::size_t vertex = (*body.kept_vertices)[at];
      EXPECT_LE(distance(&body.positions_m[3 * at], &true_m[3 * vertex]), max_error_m);
      EXPECT_LE(distance(&body.velocities_m_s[3 * at], &true_m_s[3 * vertex]),
                ann_.subscribed.max_velocity_error_m_s());
    }
  }
}

TEST_F(StreamContents, ACoarseTopologyIsMadeAndSentOnce) {
  change(add_second_ball());
  v1::Subscribe request;
  request.set_level_of_detail(1);
  subscribe(ann_, request);
  see(ann_, tick());
  ASSERT_TRUE(make_deferred());
  const auto frame = see(ann_, tick());
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->bodies.size(), 2U);
  EXPECT_EQ(ann_.topologies, 1U) << "both balls have one mesh";

  request.set_scalars(true);  // another class of the same session
  subscribe(ann_, request);
  EXPECT_TRUE(see(ann_, tick()));
  EXPECT_EQ(ann_.topologies, 1U);
  EXPECT_EQ(ann_.layouts.size(), 2U);

  request.add_known_topologies(ann_.layouts[0].soft_bodies(0).topology_hash());
  subscribe(bob_, request);
  bob_.decoder = client::StreamDecoder(ann_.decoder.topologies());
  ASSERT_TRUE(bob_.decoder.add_stream(bob_.subscribed).ok());
  EXPECT_TRUE(see(bob_, tick()));
  EXPECT_EQ(bob_.topologies, 0U);
  EXPECT_FALSE(make_deferred());
}

TEST_F(StreamContents, AnEditOfAWorldAtRestIsShownWhenItsMeshIsThere) {
  v1::Subscribe request;
  request.set_level_of_detail(1);
  subscribe(ann_, request);
  see(ann_, tick());
  ASSERT_TRUE(make_deferred());
  ASSERT_TRUE(see(ann_, tick()));

  v1::ClientMessage edit = add_second_ball();
  v1::SceneEdit& changes = *edit.mutable_edit()->mutable_edit();
  v1::SoftBody ball = changes.changes(0).add_soft_body();
  ball.set_mesh("finer");
  ball.mutable_springs()->set_stiffness_n_m(50.0);
  ball.mutable_springs()->set_damping_n_s_m(0.1);
  changes.clear_changes();
  v1::Mesh& finer = *changes.add_changes()->mutable_add_mesh();
  finer.set_name("finer");
  finer.mutable_icosphere()->set_subdivisions(2);
  *changes.add_changes()->mutable_add_soft_body() = ball;
  change(edit);
  const auto rest = [&] {
    Outbox outbox;
    hub_.encode_rest(LiveFrames(world_.physics()), world_.tick(), outbox);
    return see(ann_, outbox);
  };
  EXPECT_FALSE(rest());
  EXPECT_FALSE(rest());
  ASSERT_TRUE(make_deferred());
  const auto frame = rest();
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->key);
  EXPECT_EQ(frame->tick, world_.tick());
  EXPECT_EQ(frame->bodies[1].positions_m.size(), 3U * 41);
  EXPECT_FALSE(rest());
}

TEST_F(StreamContents, PastTheCoarsestThereIsTheCoarsestAndPastTheLimitNothing) {
  v1::Subscribe request;
  request.set_level_of_detail(base::level_of_detail_max);
  subscribe(ann_, request);
  see(ann_, tick());
  ASSERT_TRUE(make_deferred());
  EXPECT_EQ(see(ann_, tick())->bodies[0].kept_vertices->size(), 12U);
  request.set_level_of_detail(base::level_of_detail_max + 1);
  const auto refused = hub_.subscribe(bob_.viewer.session(), request, 60.0);
  EXPECT_EQ(refused.status().code(), base::StatusCode::limit_exceeded);
  EXPECT_EQ(refused.status().where(), "subscribe.level_of_detail");
}

TEST(LiveFrames, TellTheTrianglesOfAColliderThatIsAMesh) {
  v1::Scene scene = ball_scene();
  v1::Collider& ground = *scene.add_colliders();
  ground.set_name("ground");
  ground.mutable_shape()->set_mesh(scene.meshes(0).name());
  ground.mutable_position()->set_y(-9.0);
  auto built = scene_io::to_physics(scene);
  ASSERT_TRUE(built.ok()) << built.status().message();
  const auto world = physics::World::create(std::move(*built));
  ASSERT_TRUE(world.ok());
  v1::Layout layout;
  LiveFrames(*world).describe_solids(layout);
  const v1::Layout::Solid& solid = layout.solids(layout.solids_size() - 1);
  const physics::Mesh& mesh = *world->soft_body(0).mesh;
  EXPECT_EQ(solid.shape().mesh(), scene.meshes(0).name());
  ASSERT_EQ(static_cast<std::size_t>(solid.surface().positions_size()), mesh.positions_m.size());
  EXPECT_EQ(solid.surface().positions(5).y(), mesh.positions_m[5].y());
  ASSERT_EQ(static_cast<std::size_t>(solid.surface().indices_size()), 3 * mesh.faces.size());
  EXPECT_EQ(solid.surface().indices(4), mesh.faces[1][1]);
}

// About the centre of mass, which is where the poses place it.
TEST(LiveFrames, TellTheTrianglesOfARigidMeshAboutItsCentreOfMass) {
  v1::Scene scene;
  v1::Mesh& mesh = *scene.add_meshes();
  mesh.set_name("wedge");
  for (const auto& [x, y, z] : {std::array{1.0, 2.0, 3.0}, {5.0, 2.0, 3.0}, {1.0, 6.0, 3.0}, {1.0, 2.0, 7.0}}) {
    v1::Vec3& position = *mesh.mutable_triangles()->add_positions();
    position.set_x(x);
    position.set_y(y);
    position.set_z(z);
  }
  for (const std::uint32_t i : {0U, 2U, 1U, 0U, 1U, 3U, 1U, 2U, 3U, 2U, 0U, 3U})
    mesh.mutable_triangles()->add_indices(i);
  v1::RigidBody& body = *scene.add_rigid_bodies();
  body.set_name("wedge");
  body.mutable_shape()->set_mesh("wedge");
  body.mutable_position()->set_y(4.0);
  auto built = scene_io::to_physics(scene);
  ASSERT_TRUE(built.ok()) << built.status().message();
  const auto world = physics::World::create(std::move(*built));
  ASSERT_TRUE(world.ok());
  v1::Layout layout;
  LiveFrames(*world).describe_solids(layout);
  const v1::Layout::Solid& solid = layout.solids(0);
  EXPECT_EQ(solid.shape().mesh(), "wedge");
  ASSERT_EQ(solid.surface().positions_size(), 4);
  EXPECT_NEAR(solid.surface().positions(0).x(), -1.0, 1e-14);
  EXPECT_NEAR(solid.surface().positions(3).z(), 3.0, 1e-14);
  EXPECT_EQ(solid.surface().indices_size(), 12);
  EXPECT_EQ(LiveFrames(*world).poses()[0].position, physics::Vec3d(0, 4, 0));
}

}  // namespace
}  // namespace pneuma::app
