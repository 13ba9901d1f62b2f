// Shows how messages of a stream become frames, and that each message that does not fit is refused, with its reason,
// and leaves the stream as it was. No sockets.
#include <limits>

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/limits.h"
#include "codec/topology_hash.h"
#include "pneuma_client/frames.h"
#include "support/process_memory.h"
#include "unit/client/fake_server.h"

namespace pneuma::client {
namespace {

constexpr std::uint32_t stream_id = 7;

class StreamDecoderTest : public testing::Test {
 protected:
  void SetUp() override {
    add_stream(stream_id);
    ASSERT_TRUE(decoder.take_topology(topology_message().topology()).ok());
    ASSERT_TRUE(decoder.take_layout(layout_message(stream_id).layout()).ok());
  }

  void add_stream(std::uint32_t id) {
    v1::ServerMessage message;
    fill_subscribed(id, message);
    ASSERT_TRUE(decoder.add_stream(message.subscribed()).ok());
  }

  base::Result<std::optional<DecodedFrame>> take(const v1::ServerMessage& message) {
    return decoder.take_frame(message.frame(), 100);
  }

  void expect_refused(const v1::ServerMessage& message, const std::string& reason) {
    const auto frame = take(message);
    ASSERT_FALSE(frame.ok());
    EXPECT_EQ(frame.status().code(), base::StatusCode::malformed);
    EXPECT_NE(frame.status().message().find(reason), std::string::npos) << frame.status().message();
    EXPECT_NE(frame.status().message().find("stream 7"), std::string::npos) << frame.status().message();
  }

  StreamDecoder decoder;
};

TEST_F(StreamDecoderTest, KeyFrameStandsAlone) {
  const auto frame = take(key_frame(stream_id, 12, 5));
  ASSERT_TRUE(frame.ok()) << frame.status().message();
  ASSERT_TRUE(frame->has_value());
  EXPECT_EQ((*frame)->world, "w");
  EXPECT_EQ((*frame)->tick, 12U);
  EXPECT_TRUE((*frame)->key);
  EXPECT_EQ((*frame)->bytes, 100U);
  ASSERT_EQ((*frame)->bodies.size(), 1U);
  EXPECT_EQ((*frame)->bodies[0].name, "ball");
  EXPECT_EQ((*frame)->bodies[0].topology->indices.size(), 12U);
  ASSERT_EQ((*frame)->bodies[0].positions_m.size(), 12U);
  EXPECT_DOUBLE_EQ((*frame)->bodies[0].positions_m[0], 0.005);
  EXPECT_DOUBLE_EQ((*frame)->bodies[0].positions_m[3], 1.005);
  ASSERT_EQ((*frame)->solids.size(), 1U);
  EXPECT_EQ((*frame)->solids[0].name, "floor");
  EXPECT_EQ((*frame)->solids[0].position.y(), -1.0);
}

TEST_F(StreamDecoderTest, DeltaFramesBuildOnTheLastAndKeepPoses) {
  ASSERT_TRUE(take(key_frame(stream_id, 1)).ok());
  ASSERT_TRUE(take(delta_frame(stream_id, 2, 1, 3, 0)).ok());
  const auto frame = take(delta_frame(stream_id, 4, 2, -2, 3));
  ASSERT_TRUE(frame.ok()) << frame.status().message();
  EXPECT_FALSE((*frame)->key);
  EXPECT_DOUBLE_EQ((*frame)->bodies[0].positions_m[0], -0.002);
  EXPECT_EQ((*frame)->solids[0].position.y(), -1.0);
}

TEST_F(StreamDecoderTest, DeltaBeforeAnyKeyFrameIsRefused) {
  expect_refused(delta_frame(stream_id, 2, 1, 3, 0), "on top of tick 1");
}

TEST_F(StreamDecoderTest, DeltaOnAnotherFrameIsRefusedAndTheStreamGoesOn) {
  ASSERT_TRUE(take(key_frame(stream_id, 1)).ok());
  expect_refused(delta_frame(stream_id, 9, 8, 3, 0), "on top of tick 8");
  const auto frame = take(delta_frame(stream_id, 2, 1, 3, 0));
  ASSERT_TRUE(frame.ok()) << frame.status().message();
  EXPECT_DOUBLE_EQ((*frame)->bodies[0].positions_m[0], 0.003);
}

TEST_F(StreamDecoderTest, SpoiltPayloadIsRefusedAndTheStreamGoesOn) {
  ASSERT_TRUE(take(key_frame(stream_id, 1)).ok());
  auto spoilt = delta_frame(stream_id, 2, 1, 3, 0);
  spoilt.mutable_frame()->mutable_payload()->append(2, '\0');
  expect_refused(spoilt, "payload: the residuals do not end where the payload does");
  const auto frame = take(delta_frame(stream_id, 2, 1, 3, 0));
  ASSERT_TRUE(frame.ok()) << frame.status().message();
  EXPECT_EQ((*frame)->time_s, 1.0 / 60.0 + 1.0 / 60.0) << "the time of the refused one does not count";
}

TEST_F(StreamDecoderTest, LayersBuildOnLowerOnesAlone) {
  const auto layered = [](std::uint64_t tick, std::uint64_t base_tick, std::int64_t offset, std::uint32_t layer,
                          std::int64_t base_offset = 0) {
    auto message = delta_frame(stream_id, tick, base_tick, offset, base_offset);
    message.mutable_frame()->set_layer(layer);
    return message;
  };
  const auto x_of = [&](const v1::ServerMessage& message) {
    const auto frame = take(message);
    EXPECT_TRUE(frame.ok()) << frame.status().message();
    return frame.ok() ? (*frame)->bodies[0].positions_m[0] : 0.0;
  };
  ASSERT_TRUE(take(key_frame(stream_id, 4)).ok());
  expect_refused(layered(5, 4, 1, 3), "no layer 3");
  EXPECT_DOUBLE_EQ(x_of(layered(5, 4, 10, 2)), 0.010);
  EXPECT_DOUBLE_EQ(x_of(layered(6, 4, 20, 1)), 0.020) << "not on the frame of layer 2";
  EXPECT_DOUBLE_EQ(x_of(layered(7, 6, 30, 2, 20)), 0.030);
  expect_refused(layered(8, 7, 40, 2), "on top of tick 7");
  expect_refused(layered(8, 6, 40, 1), "on top of tick 6");
  expect_refused(layered(8, 6, 40, 0), "on top of tick 6");
  EXPECT_DOUBLE_EQ(x_of(layered(8, 4, 40, 0)), 0.040);
  auto key = key_frame(stream_id, 9);
  key.mutable_frame()->set_layer(1);
  expect_refused(key, "layer 0");
}

TEST_F(StreamDecoderTest, TheTimeThatAFrameDoesNotTellGoesOnFromItsBases) {
  const auto time_s_of = [&](v1::ServerMessage message, std::uint32_t layer) {
    message.mutable_frame()->set_layer(layer);
    const auto frame = take(message);
    EXPECT_TRUE(frame.ok()) << frame.status().message();
    return frame.ok() ? (*frame)->time_s : 0.0;
  };
  auto told = delta_frame(stream_id, 8, 4, 1, 0);
  told.mutable_frame()->set_time_s(7.0);
  const double tick_s = 1.0 / 60.0;
  EXPECT_EQ(time_s_of(key_frame(stream_id, 4), 0), 4.0 / 60.0);
  EXPECT_EQ(time_s_of(delta_frame(stream_id, 6, 4, 1, 0), 1), 4.0 / 60.0 + 2.0 * tick_s);
  EXPECT_EQ(time_s_of(delta_frame(stream_id, 7, 6, 2, 1), 2), 4.0 / 60.0 + 2.0 * tick_s + tick_s);
  EXPECT_EQ(time_s_of(told, 0), 7.0);
  EXPECT_EQ(time_s_of(delta_frame(stream_id, 9, 8, 2, 1), 0), 7.0 + tick_s);
  EXPECT_EQ(time_s_of(delta_frame(stream_id, 14, 6, 2, 1), 2), 4.0 / 60.0 + 2.0 * tick_s + 8.0 * tick_s);
  expect_refused(delta_frame(stream_id, 8, 9, 2, 1), "before its base");
}

TEST_F(StreamDecoderTest, FrameOfAnotherLayoutIsRefused) {
  expect_refused(key_frame(stream_id, 1, 0, 2), "layout 2");
  ASSERT_TRUE(take(key_frame(stream_id, 1)).ok());
  auto delta = delta_frame(stream_id, 2, 1, 3, 0);
  delta.mutable_frame()->set_layout_id(2);
  expect_refused(delta, "layout 2");
}

TEST_F(StreamDecoderTest, NewLayoutWantsAKeyFrame) {
  ASSERT_TRUE(take(key_frame(stream_id, 1)).ok());
  ASSERT_TRUE(decoder.take_layout(layout_message(stream_id, 2).layout()).ok());
  auto delta = delta_frame(stream_id, 2, 1, 3, 0);
  delta.mutable_frame()->set_layout_id(2);
  expect_refused(delta, "on top of tick 1");
  EXPECT_TRUE(take(key_frame(stream_id, 2, 0, 2)).ok());
}

TEST_F(StreamDecoderTest, PoseOfNoSolidIsRefused) {
  auto frame = key_frame(stream_id, 1);
  frame.mutable_frame()->mutable_poses(0)->set_solid(1);
  expect_refused(frame, "solid 1");
}

TEST_F(StreamDecoderTest, FramesOfAnEndedStreamAreIgnored) {
  decoder.remove_stream(stream_id);
  const auto frame = take(key_frame(stream_id, 1));
  ASSERT_TRUE(frame.ok());
  EXPECT_FALSE(frame->has_value());
  EXPECT_TRUE(decoder.take_layout(layout_message(stream_id).layout()).ok());
}

TEST_F(StreamDecoderTest, SubscribingTwiceKeepsTheStream) {
  ASSERT_TRUE(take(key_frame(stream_id, 1)).ok());
  add_stream(stream_id);
  EXPECT_TRUE(take(delta_frame(stream_id, 2, 1, 3, 0)).ok());
}

TEST_F(StreamDecoderTest, StreamsShareTopologies) {
  add_stream(8);
  ASSERT_TRUE(decoder.take_layout(layout_message(8).layout()).ok());
  const auto first = take(key_frame(stream_id, 1));
  const auto second = take(key_frame(8, 1));
  EXPECT_EQ((*first)->bodies[0].topology, (*second)->bodies[0].topology);
  EXPECT_EQ(decoder.topologies().size(), 1U);
}

// A few bytes name 65,536 vertices without triangles, and their order in frames takes megabytes.
TEST_F(StreamDecoderTest, ATopologyThatNoStreamNamesCostsLittle) {
  const auto held_bytes = [] { return support::memory_bytes(::getpid(), "VmRSS:").value_or(0); };
  const std::size_t before = held_bytes();
  for (std::uint32_t i = 0; i < 50; ++i) {
    v1::Topology topology;
    topology.set_vertex_count(base::mesh_vertices_max - i);
    topology.set_hash(codec::topology_hash(topology.vertex_count(), {}));
    ASSERT_TRUE(decoder.take_topology(topology).ok());
  }
  EXPECT_LT(held_bytes(), before + 20'000'000);  // 190 MB if each had its order
}

TEST_F(StreamDecoderTest, TopologiesOutliveTheDecoder) {
  StreamDecoder later(decoder.topologies());
  v1::ServerMessage message;
  fill_subscribed(1, message);
  ASSERT_TRUE(later.add_stream(message.subscribed()).ok());
  EXPECT_TRUE(later.take_layout(layout_message(1).layout()).ok());
}

TEST_F(StreamDecoderTest, LayoutWithUnknownTopologyIsRefused) {
  auto layout = layout_message(stream_id).layout();
  layout.mutable_soft_bodies(0)->set_topology_hash(std::string(16, 'x'));
  const auto status = decoder.take_layout(layout);
  EXPECT_EQ(status.message(), "soft_bodies.ball: its topology was never sent");
}

TEST_F(StreamDecoderTest, LayoutPastTheWorldsLimitsIsRefused) {
  auto layout = layout_message(stream_id).layout();
  while (layout.soft_bodies_size() <= static_cast<int>(base::world_bodies_max)) {
    *layout.add_soft_bodies() = layout.soft_bodies(0);
  }
  EXPECT_FALSE(decoder.take_layout(layout).ok());
}

v1::Mechanics mechanics_of_tetrahedron() {
  v1::Mechanics mechanics;
  mechanics.set_frame_s(0.02);
  mechanics.set_substeps(4);
  mechanics.add_masses_kg(0.25F);
  for (int edge = 0; edge < 6; ++edge) mechanics.add_rest_lengths_m(1.0F);
  mechanics.add_stiffnesses_n_m(100.0F);
  mechanics.mutable_gravity_m_s2()->set_y(-9.81);
  return mechanics;
}

TEST_F(StreamDecoderTest, MechanicsThatCannotBeAreRefusedWithTheirLayout) {
  const auto taken_with = [this](auto&& change) {
    auto layout = layout_message(stream_id).layout();
    v1::Mechanics& mechanics = *layout.mutable_soft_bodies(0)->mutable_mechanics();
    mechanics = mechanics_of_tetrahedron();
    change(mechanics);
    return decoder.take_layout(layout);
  };
  EXPECT_TRUE(taken_with([](v1::Mechanics&) {}).ok());
  ASSERT_TRUE(decoder.take_layout(layout_message(stream_id).layout()).ok());
  ASSERT_TRUE(take(key_frame(stream_id, 1)).ok());
  const auto status = taken_with([](v1::Mechanics& mechanics) { mechanics.add_rest_lengths_m(1.0F); });
  EXPECT_EQ(status.code(), base::StatusCode::malformed);
  EXPECT_EQ(status.message(), "soft_bodies.ball.mechanics.rest_lengths_m: must be one an edge, none below 0");
  EXPECT_FALSE(taken_with([](v1::Mechanics& mechanics) { mechanics.set_substeps(65); }).ok());
  EXPECT_FALSE(taken_with([](v1::Mechanics& mechanics) { mechanics.mutable_gas()->set_pressure_pa(1.0); }).ok());
  EXPECT_FALSE(taken_with([](v1::Mechanics& mechanics) { mechanics.set_frame_s(0.0); }).ok());
  EXPECT_FALSE(taken_with([](v1::Mechanics& mechanics) {
                 for (int plane = 0; plane < 17; ++plane) mechanics.add_planes();
               }).ok());
  EXPECT_TRUE(take(delta_frame(stream_id, 2, 1, 3, 0)).ok()) << "the stream is as it was";
}

TEST_F(StreamDecoderTest, MoreThanMayBeSimulatedIsRefused) {
  const std::uint32_t vertices = base::mesh_vertices_max;
  v1::Topology topology;
  topology.set_vertex_count(vertices);
  topology.set_hash(codec::topology_hash(vertices, {}));
  ASSERT_TRUE(decoder.take_topology(topology).ok());
  auto layout = layout_message(stream_id).layout();
  layout.mutable_soft_bodies(0)->set_topology_hash(topology.hash());
  v1::Mechanics& mechanics = *layout.mutable_soft_bodies(0)->mutable_mechanics();
  mechanics = mechanics_of_tetrahedron();
  mechanics.clear_rest_lengths_m();
  mechanics.set_substeps(16);
  EXPECT_TRUE(decoder.take_layout(layout).ok());
  mechanics.set_substeps(17);
  const auto status = decoder.take_layout(layout);
  EXPECT_EQ(status.message(), "soft_bodies.ball.mechanics: more to be simulated than any stream asks for");
  mechanics.add_planes()->mutable_normal()->set_y(1.0);
  mechanics.set_substeps(9);
  EXPECT_FALSE(decoder.take_layout(layout).ok()) << "a plane is tried at each vertex";
  mechanics.set_substeps(8);
  EXPECT_TRUE(decoder.take_layout(layout).ok());
}

TEST_F(StreamDecoderTest, GridStepThatIsNoLengthIsRefused) {
  for (const double step_m : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    v1::Subscribed subscribed;
    subscribed.set_stream_id(9);
    subscribed.set_grid_step_m(step_m);
    EXPECT_FALSE(decoder.add_stream(subscribed).ok()) << step_m;
  }
}

/// Of a stream with velocities, on a grid of 1 m/s: every vertex has `steps` in each axis.
v1::ServerMessage with_velocities(v1::ServerMessage frame, std::int64_t steps) {
  frame.mutable_frame()->set_velocities(key_frame(0, 0, steps).frame().payload());
  return frame;
}

class StreamWithVelocities : public StreamDecoderTest {
 protected:
  void SetUp() override {
    v1::ServerMessage message;
    fill_subscribed(stream_id, message);
    message.mutable_subscribed()->set_velocity_grid_step_m_s(1.0);
    ASSERT_TRUE(decoder.add_stream(message.subscribed()).ok());
    ASSERT_TRUE(decoder.take_topology(topology_message().topology()).ok());
    ASSERT_TRUE(decoder.take_layout(layout_message(stream_id).layout()).ok());
  }
};

TEST_F(StreamWithVelocities, TheyAreReadOnTheirOwnGrid) {
  const auto frame = take(with_velocities(key_frame(stream_id, 1, 5), 7));
  ASSERT_TRUE(frame.ok()) << frame.status().message();
  EXPECT_TRUE((*frame)->has_velocities);
  EXPECT_FALSE((*frame)->has_scalars);
  EXPECT_DOUBLE_EQ((*frame)->bodies[0].positions_m[0], 0.005);
  EXPECT_DOUBLE_EQ((*frame)->bodies[0].velocities_m_s[0], 7.0);
}

TEST_F(StreamWithVelocities, SpoiltOnesEndTheChainUntilTheNextKey) {
  ASSERT_TRUE(take(with_velocities(key_frame(stream_id, 1), 7)).ok());
  expect_refused(delta_frame(stream_id, 2, 1, 3, 0), "velocities");  // it has none
  expect_refused(with_velocities(delta_frame(stream_id, 2, 1, 3, 0), 7), "on top of tick 1");
  EXPECT_TRUE(take(with_velocities(key_frame(stream_id, 2), 7)).ok());
}

TEST_F(StreamWithVelocities, AGridStepThatIsNoSpeedIsRefused) {
  v1::ServerMessage message;
  fill_subscribed(9, message);
  for (const double step_m_s : {-1.0, std::numeric_limits<double>::infinity()}) {
    message.mutable_subscribed()->set_velocity_grid_step_m_s(step_m_s);
    EXPECT_FALSE(decoder.add_stream(message.subscribed()).ok()) << step_m_s;
  }
}

TEST_F(StreamDecoderTest, ContactsAreOfWhatTheLayoutNames) {
  auto message = key_frame(stream_id, 1);
  v1::Contact& contact = *message.mutable_frame()->add_contacts();
  contact.set_vertex(3);
  contact.set_other_solid(1);
  expect_refused(message, "contacts");
  contact.set_other_soft(1);
  expect_refused(message, "contacts");
  contact.set_other_solid(0);
  contact.set_soft(1);
  expect_refused(message, "contacts");
  contact.set_soft(0);
  const auto frame = take(message);
  ASSERT_TRUE(frame.ok()) << frame.status().message();
  ASSERT_EQ((*frame)->contacts.size(), 1U);
  EXPECT_EQ((*frame)->contacts[0].vertex, 3U);
  EXPECT_EQ((*frame)->contacts[0].other_solid, 0U);
  for (std::size_t i = 0; i < base::frame_contacts_max; ++i) *message.mutable_frame()->add_contacts() = contact;
  expect_refused(message, "contacts");
}

TEST_F(StreamDecoderTest, AContactsVertexIsOneOfItsMeshAndItsNormalFinite) {
  auto message = key_frame(stream_id, 1);
  v1::Contact& contact = *message.mutable_frame()->add_contacts();
  contact.set_vertex(4);
  expect_refused(message, "contacts");
  contact.set_vertex(3);
  contact.mutable_normal()->set_y(std::numeric_limits<double>::quiet_NaN());
  expect_refused(message, "contacts");
  contact.mutable_normal()->set_y(1.0);
  EXPECT_TRUE(take(message).ok());

  auto layout = layout_message(stream_id).layout();
  for (const std::uint32_t kept : {3U, 5U, 8U, 13U}) layout.mutable_soft_bodies(0)->add_kept_vertices(kept);
  ASSERT_TRUE(decoder.take_layout(layout).ok());
  contact.set_vertex(7);
  EXPECT_TRUE(take(message).ok()) << "of the whole mesh, whatever is kept";
  contact.set_vertex(static_cast<std::uint32_t>(base::mesh_vertices_max));
  expect_refused(message, "contacts");
}

TEST_F(StreamDecoderTest, ScalarsAreOneABody) {
  auto message = key_frame(stream_id, 1);
  v1::Scalars& scalars = *message.mutable_frame()->mutable_scalars();
  scalars.add_volume_m3(4.0F);
  scalars.add_pressure_pa(-3.0F);
  scalars.add_kinetic_j(2.0F);
  scalars.add_elastic_j(1.0F);
  expect_refused(message, "scalars");
  scalars.add_asleep(true);
  const auto frame = take(message);
  ASSERT_TRUE(frame.ok()) << frame.status().message();
  EXPECT_TRUE((*frame)->has_scalars);
  const BodyScalars& read = (*frame)->bodies[0].scalars;
  EXPECT_EQ(read.volume_m3, 4.0);
  EXPECT_EQ(read.pressure_pa, -3.0);
  EXPECT_EQ(read.kinetic_j, 2.0);
  EXPECT_EQ(read.elastic_j, 1.0);
  EXPECT_TRUE(read.asleep);
}

TEST_F(StreamDecoderTest, KeptVerticesAreOneAVertexAscending) {
  auto layout = layout_message(stream_id).layout();
  const auto with_kept = [&](const std::vector<std::uint32_t>& kept) {
    layout.mutable_soft_bodies(0)->mutable_kept_vertices()->Assign(kept.begin(), kept.end());
    return decoder.take_layout(layout);
  };
  const auto past_any_mesh = static_cast<std::uint32_t>(base::mesh_vertices_max);
  for (const auto& bad : std::vector<std::vector<std::uint32_t>>{
           {0, 1, 2}, {0, 1, 2, 3, 4}, {0, 2, 1, 3}, {0, 1, 1, 3}, {0, 1, 2, past_any_mesh}}) {
    EXPECT_EQ(with_kept(bad).where(), "soft_bodies.ball");
  }
  ASSERT_TRUE(with_kept({3, 5, 8, 13}).ok());
  const auto frame = take(key_frame(stream_id, 1));
  ASSERT_TRUE(frame.ok());
  EXPECT_EQ(*(*frame)->bodies[0].kept_vertices, (std::vector<std::uint32_t>{3, 5, 8, 13}));
}

TEST(TakeTopology, RefusesWhatIsNoMesh) {
  StreamDecoder decoder;
  auto topology = topology_message().topology();
  topology.set_hash(std::string(16, '\0'));
  EXPECT_EQ(decoder.take_topology(topology).where(), "topology.hash");

  topology = topology_message().topology();
  topology.set_indices(4, 4);
  EXPECT_EQ(decoder.take_topology(topology).message(), "topology.face[1]: no vertex 4");

  topology = topology_message().topology();
  topology.add_indices(0);
  EXPECT_EQ(decoder.take_topology(topology).where(), "topology.indices");

  topology = topology_message().topology();
  topology.set_vertex_count(static_cast<std::uint32_t>(base::mesh_vertices_max) + 1);
  EXPECT_FALSE(decoder.take_topology(topology).ok());
  EXPECT_TRUE(decoder.topologies().empty());
}

}  // namespace
}  // namespace pneuma::client
