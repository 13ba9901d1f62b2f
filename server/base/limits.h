// Limits that a client or an operator meets, each with its reason. Those that a deployment may change are members of
// Limits, set by flags or the configuration file; the rest are constants. Those of tokens are in token_limits.h.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace pneuma::base {

inline constexpr std::uint32_t protocol_version = 1;

// A mesh's indices fit 16 bits on the wire of small clients.
inline constexpr std::size_t mesh_vertices_max = 65'536;
// Euler: a closed surface of V vertices has about 2 V faces; more is no mesh that we can serve in time.
inline constexpr std::size_t mesh_faces_max = 4 * mesh_vertices_max;
// Of a hole to be closed: the time for it goes with the square, 50 ms here.
inline constexpr std::size_t mesh_hole_vertices_max = 2'048;
inline constexpr std::size_t world_bodies_max = 1'024;
inline constexpr std::size_t world_vertices_max = 262'144;
inline constexpr std::size_t world_colliders_max = 256;
// Of all colliders that are meshes, together: layouts hold their triangles.
inline constexpr std::size_t collider_mesh_vertices_max = mesh_vertices_max;
// Two convex bodies compare their edges in pairs: up to 186 of each at this many vertices.
inline constexpr std::size_t rigid_mesh_vertices_max = 64;
// One for each body.
inline constexpr std::size_t world_joints_max = 1'024;
// Ten fingers for each of a few people.
inline constexpr std::size_t body_grabs_max = 64;
// By all grabs of a body together. Each is a spring more in every substep.
inline constexpr std::size_t body_held_vertices_max = 4'096;
// A subdivision more would pass mesh_vertices_max: 10 * 4^6 + 2 = 40,962.
inline constexpr std::uint32_t icosphere_subdivisions_max = 6;
// At the largest of each, the hand's volume is off by 0.01 % and 0.2 % and costs fifty and two hundred exact ones. At
// the defaults it is off by 1 % and 2 %.
inline constexpr std::uint32_t volume_subdivisions_max = 128;
inline constexpr std::uint32_t volume_subdivisions_default = 16;
inline constexpr std::uint32_t volume_samples_max = 65'536;
inline constexpr std::uint32_t volume_samples_default = 4'096;
// Where the faces of a skin cross the rows of its cells or samples, and the samples that they cover: a dozen times what
// the largest ball takes at the finest, some 0.03 s. Only a skin in many layers has more; it is measured exactly.
inline constexpr std::uint64_t volume_crossings_max = 1U << 22;
inline constexpr std::uint32_t substeps_max = 4'096;
// Newton converges in a handful, or not at all.
inline constexpr std::uint32_t newton_iterations_max = 64;
inline constexpr double rate_hz_max = 1'000.0;
inline constexpr double rate_hz_min = 1.0;
// Past this a particle crosses a room in one step at any rate; such a body is frozen and reported.
inline constexpr double speed_max_m_s = 1e5;
// A particle that crosses its own body this often in one step, seen from the body, is an explosion, not a motion: no
// step resolves it. Stopped at the speed limit alone, it has by then thrown aside what it touches.
inline constexpr double runaway_body_lengths = 2.0;
// Far enough for any scene; near enough that double keeps a micrometre and the frame codec's integers hold.
inline constexpr double coordinate_max_m = 1e7;
inline constexpr std::size_t name_bytes_max = 128;
// The largest magnitude of a scene's numbers that have no narrower limit of their own: far past any scene, near enough
// that a product of three of them, squared lengths among them, is still a number in single precision.
inline constexpr double scene_number_max = 1e12;
// A speck of dust: what divides by a mass stays a number.
inline constexpr double mass_min_kg = 1e-9;
// Of one body's heaviest vertex over its lightest. The sums over a body keep seven digits of the lightest's share.
inline constexpr double vertex_mass_ratio_max = 1e9;
// A tenth of a micrometre: below every scene, and the volume of such a body is still a number in single precision.
inline constexpr double extent_min_m = 1e-7;
// From rest to speed_max_m_s in a tenth of a second.
inline constexpr double acceleration_max_m_s2 = 1e6;
// Springs that want to be a thousand times as long as they are drawn are no drawing of the body.
inline constexpr double rest_scale_max = 1e3;
// No gas is past 5/3; the power of a volume's ratio stays a number.
inline constexpr double heat_capacity_ratio_max = 10.0;
// Friction and drag: a body that is all brake.
inline constexpr double coefficient_max = 1e6;
// Single precision resolves 6e-8 of a coordinate, and those of a body are seen from near it. This many times the
// shortest edge away, that is 0.6 % of the edge, and springs begin to pull on rounding.
inline constexpr double single_precision_edges_max = 1e5;

// Before a client has said who it is, it may cost us one small buffer.
inline constexpr std::size_t message_bytes_max_before_hello = 4 * 1024;
// Of a message sent in parts: room for a mesh of the largest size, written out as text.
inline constexpr std::size_t parts_bytes_max = 16 * 1024 * 1024;
// In which a message in parts must come at message_bytes_max: 280 kbit/s, a third of what a slow link has.
inline constexpr std::chrono::seconds parts_timeout{30};
// What a message may take in memory once it is read: empty fields are small on the wire alone.
inline constexpr std::size_t message_memory_bytes_max = 64 * 1024 * 1024;
// The same for each byte that came, beside message_memory_bytes_small: names and changes of a few bytes take some 40.
inline constexpr std::size_t message_memory_growth_max = 64;
inline constexpr std::size_t message_memory_bytes_small = 256 * 1024;
// Of a message, those within it too: a position of a mesh is four, and there may be world_vertices_max of them.
inline constexpr std::size_t message_fields_max = 8 * world_vertices_max;
// Messages within each other: an edit that adds a mesh has 8.
inline constexpr std::size_t message_depth_max = 32;
// Of a ClientMessage itself, which has two: a request id and a request. The rest is room for newer clients.
inline constexpr std::size_t envelope_fields_max = 16;
// Larger ones are parsed off the network thread: this much takes 0.1 ms at worst.
inline constexpr std::size_t message_bytes_max_at_once = 1024;
// Of a scene or edit as text, each a message in memory; most are positions.
inline constexpr std::size_t json_objects_max = 2 * world_vertices_max;
// All in such text, objects and lists among them: a position has three numbers and is one itself.
inline constexpr std::size_t json_values_max = 4 * json_objects_max;
// No message has as many fields.
inline constexpr std::size_t json_keys_max = 256;
// Finer than a micrometre a double cannot keep at coordinate_max_m; coarser than ten metres nothing is left to see; a
// millimetre is what a display shows of a body of a metre.
inline constexpr double max_error_min_m = 1e-6;
inline constexpr double max_error_max_m = 10.0;
inline constexpr double max_error_default_m = 1e-3;
// A quarter of the vertices a level: the largest mesh is down to coarse_vertices_min in seven.
inline constexpr std::uint32_t level_of_detail_max = 8;
// As many as an icosahedron has: fewer show no shape.
inline constexpr std::size_t coarse_vertices_min = 12;
// Replies that a world makes in one go before it hands them to the network, where the sessions' own limits count.
inline constexpr std::size_t drain_reply_bytes_max = 1024 * 1024;
// One client may make all of the server's worlds but a fourth.
inline constexpr std::size_t worlds_kept_from_client = 4;
// Worlds that wait to be built: what a room full of people asks for at once.
inline constexpr std::size_t world_builds_waiting_max = 64;
inline constexpr std::size_t world_builds_waiting_bytes_max = 64 * 1024 * 1024;  // and what their requests may hold

// Ten minutes at 60 Hz, for all the steps together that wait on a paused world; a pause ends them sooner.
inline constexpr std::uint32_t step_ticks_max = 36'000;
// A State is half of the output queue at most. The largest body at double precision takes 3 MB with its velocities.
inline constexpr std::size_t state_bytes_max = 4 * 1024 * 1024;
// A stream of plain frames takes one gigabit a second, more than a network between two machines takes.
inline constexpr double plain_bytes_s_max = 125e6;

// Rays or points of one request.
inline constexpr std::size_t query_points_max = 1'024;
// Faces that they may look at, all together: 0.4 s. In the middle of a ball, each point looks at all of its faces.
inline constexpr std::uint64_t query_looks_max = 1U << 23;
// More touches in a tick than an ear or a script takes apart; some 110 bytes each, and 360 with the longest names.
inline constexpr std::size_t touches_a_tick_max = 64;
// Of one stream, over the world's time: 0.2 MB a second, and 0.7 with the longest names.
inline constexpr double touches_per_s_max = 2'000.0;

// Each quality (rate, error bound, and what the frames hold) of a world costs an encoding a tick.
inline constexpr std::size_t world_quality_classes_max = 32;
// Of these, those that one client alone reads: others find a fourth.
inline constexpr std::size_t client_quality_classes_max = world_quality_classes_max / 4 * 3;
// More points than an eye tells apart; some 40 bytes each.
inline constexpr std::size_t frame_contacts_max = 256;
// No client takes them all.
inline constexpr std::size_t session_streams_per_world_max = 8;
// More hands than a room full of people has; each is a spring more in every substep.
inline constexpr std::size_t world_grabs_max = 256;
// Requests that wait for a world's next tick: a second of what 64 busy clients may send.
inline constexpr std::size_t world_inbox_requests_max = 4'096;
inline constexpr std::size_t world_inbox_bytes_max = 64 * 1024 * 1024;  // and what they may hold in all
// Of the factor of an implicit step's matrix, below its diagonal: the largest ball has 2.3 million, the largest
// box 3.3. A dense matrix with as many takes ten seconds to factor, a surface of many handles likewise.
inline constexpr std::size_t factor_entries_max = 6'000'000;
// Far past any scene, near enough that its square is a number.
inline constexpr double impulse_max_n_s = 1e9;
inline constexpr double stiffness_max_n_m = 1e9;
inline constexpr double damping_max_n_s_m = 1e9;

// The largest world at double precision takes 13 MB, and its scene twice: as it was created, and as it is now.
inline constexpr std::size_t checkpoint_bytes_max = 256 * 1024 * 1024;
// A world file comes back as one message in parts, with its name and field heads.
inline constexpr std::size_t world_file_bytes_max = parts_bytes_max - 64 * 1024;
// Of a snapshot in one reply: a sixteenth of the output queue, so that frames go on beside it.
inline constexpr std::size_t snapshot_piece_bytes = 512 * 1024;
// A client that has not asked for the next piece by then has gone on to something else.
inline constexpr std::chrono::seconds snapshot_timeout{60};
// Snapshots, branches and rewinds under way: each holds a copy of its world's state.
inline constexpr std::size_t look_backs_max = 8;
inline constexpr std::size_t client_look_backs_max = look_backs_max / 2;
// Of a checkpoint and its logs, read back while the server runs.
inline constexpr std::size_t history_bytes_max = 2 * checkpoint_bytes_max;
// Of what came between two checkpoints. A log as long as the first of these makes the next checkpoint due early, so
// that it does not grow with the size of edits. Past the second, edits are refused: the disk has taken no checkpoint
// meanwhile.
inline constexpr std::size_t log_bytes_before_checkpoint = 64 * 1024 * 1024;
inline constexpr std::size_t log_bytes_max = 1024 * 1024 * 1024;
// Room for a mesh of the largest size, written out.
inline constexpr std::size_t scene_file_bytes_max = 16 * 1024 * 1024;

// Of the log, while nobody reads it: past it the oldest give way. A few minutes of a busy server's.
inline constexpr std::size_t log_lines_waiting_max = 4'096;

struct Limits {
  std::size_t message_bytes_max = 1024 * 1024;  // room for a 16,000-vertex mesh; larger ones come in parts
  std::size_t connections_max = 1'024;
  std::size_t connections_per_address_max = 32;
  std::size_t worlds_max = 1'024;
  double commands_per_s = 60.0;                          // a pointer moves at display rate
  double commands_burst = 120.0;                         // two seconds of it, for a client that catches up
  bool limits_loopback = false;                          // a script on this machine asks as fast as it is answered
  std::size_t output_queue_bytes_max = 8 * 1024 * 1024;  // past it frames are dropped, then re-keyed
  // Of all queues together, where what several wait for counts once: a hundred slow readers of large worlds.
  std::size_t queued_bytes_max = 256 * 1024 * 1024;
  // Of messages that are not whole yet, or wait to be parsed, of all sessions together: 128 of the largest.
  std::size_t received_bytes_max = 128 * 1024 * 1024;
  // What came of messages in parts that are not whole yet, of all sessions together: eight of the largest.
  std::size_t parts_waiting_bytes_max = 8 * parts_bytes_max;
  // Of all requests that were parsed and wait, whoever for: four of the largest.
  std::size_t requests_memory_bytes_max = 4 * message_memory_bytes_max;
  std::chrono::milliseconds hello_timeout{2'000};
  std::chrono::milliseconds partial_message_timeout{10'000};
  std::chrono::milliseconds ping_interval{15'000};  // two unanswered close the connection
  std::chrono::milliseconds write_stall_timeout{10'000};
  std::chrono::milliseconds drain_timeout{5'000};  // SIGTERM: the time that queues get to empty
};

}  // namespace pneuma::base
