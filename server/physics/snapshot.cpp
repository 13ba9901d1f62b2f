// A world's state as bytes and as a hash: one order of fields for writing, reading and hashing.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <type_traits>

#include "base/limits.h"
#include "physics/forces/gas.h"
#include "physics/simulation.h"

namespace pneuma::physics {

namespace {

static_assert(std::endian::native == std::endian::little, "snapshots are little-endian");

class Writer {
 public:
  template <class T>
  bool field(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
    return true;
  }
  bool count(std::size_t size) {
    std::uint64_t value = size;
    return field(value);
  }
  [[nodiscard]] static bool has_more(bool held) { return held; }
  [[nodiscard]] static bool can_hold(std::uint64_t, std::size_t) { return true; }
  std::string bytes;
};

/// FNV-1a, 64 bits, over what a Writer would write.
class Hasher {
 public:
  template <class T>
  bool field(T& value) {
    std::array<unsigned char, sizeof(T)> bytes{};
    std::memcpy(bytes.data(), &value, sizeof(T));
    for (const unsigned char byte : bytes) hash = (hash ^ byte) * 0x100000001b3U;
    return true;
  }
  bool count(std::size_t size) {
    std::uint64_t value = size;
    return field(value);
  }
  [[nodiscard]] static bool has_more(bool held) { return held; }
  [[nodiscard]] static bool can_hold(std::uint64_t, std::size_t) { return true; }
  std::uint64_t hash = 0xcbf29ce484222325U;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest(bytes) {}
  template <class T>
  bool field(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (rest.size() < sizeof(T)) return false;
    if constexpr (std::is_same_v<T, bool>) {
      value = rest.front() != 0;
    } else {
      std::memcpy(&value, rest.data(), sizeof(T));
    }
    rest.remove_prefix(sizeof(T));
    return true;
  }
  bool count(std::size_t size) {
    std::uint64_t value = 0;
    return field(value) && value == size;
  }
  /// Whether there is a part at the end: it is left out where neither it nor a later one holds anything.
  [[nodiscard]] bool has_more(bool) const { return !rest.empty(); }
  /// Before room is made for so many entries of so many bytes.
  [[nodiscard]] bool can_hold(std::uint64_t count, std::size_t size) const { return count <= rest.size() / size; }
  std::string_view rest;
};

template <class Archive>
bool vector_field(Archive& archive, Vec3d& v) {
  return archive.field(v[0]) && archive.field(v[1]) && archive.field(v[2]);
}

template <class Archive>
bool pose_fields(Archive& archive, Vec3d& position, Quatd& orientation) {
  return vector_field(archive, position) && archive.field(orientation.w()) && archive.field(orientation.x()) &&
         archive.field(orientation.y()) && archive.field(orientation.z());
}

template <class Archive>
bool grab_fields(Archive& archive, Grab& grab) {
  return archive.field(grab.id) && archive.field(grab.vertex) && vector_field(archive, grab.target) &&
         archive.field(grab.stiffness_n_m) && archive.field(grab.damping_n_s_m);
}

// One byte a body: what it is about. Most are under way, and have nothing else to keep.
enum class Standing : std::uint8_t { moving, frozen, asleep, resting, near, resting_and_near };

template <class Body>
Standing standing_of(const Body& body) {
  if (body.frozen) return Standing::frozen;
  if (body.rest.asleep) return Standing::asleep;
  if (body.rest.near_ticks == 0) return body.rest.ticks > 0 ? Standing::resting : Standing::moving;
  return body.rest.ticks > 0 ? Standing::resting_and_near : Standing::near;
}

// `place_fields` handles the place that a resting body has kept, `near_fields` the one that a body is near.
template <class Archive, class Body, class PlaceFields, class NearFields>
bool standing_fields(Archive& archive, Body& body, const PlaceFields& place_fields, const NearFields& near_fields) {
  Standing standing = standing_of(body);
  if (!archive.field(standing) || standing > Standing::resting_and_near) return false;
  const bool is_resting = standing == Standing::resting || standing == Standing::resting_and_near;
  const bool is_near = standing == Standing::near || standing == Standing::resting_and_near;
  body.frozen = standing == Standing::frozen;
  body.rest.asleep = standing == Standing::asleep;
  if (!is_resting) body.rest.ticks = 0;
  if (!is_near) body.rest.near_ticks = 0;
  return (!is_resting || (archive.field(body.rest.ticks) && place_fields())) &&
         (!is_near || (archive.field(body.rest.near_ticks) && near_fields()));
}

template <class Archive, class Points>
bool points_fields(Archive& archive, Points& points) {
  for (auto& point : points) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!archive.field(point[axis])) return false;
    }
  }
  return true;
}

template <class Archive, class Real>
bool soft_fields(Archive& archive, SoftState<Real>& body) {
  if (!archive.count(body.x.size())) return false;
  if (std::is_same_v<Real, float> && !vector_field(archive, body.origin_m)) return false;
  if (!points_fields(archive, body.x) || !points_fields(archive, body.v)) return false;
  const auto place_fields = [&] {
    body.place.resize(body.x.size());
    return points_fields(archive, body.place);
  };
  const auto near_fields = [&] { return points_fields(archive, body.near_place); };
  if (!standing_fields(archive, body, place_fields, near_fields)) return false;
  if (!archive.field(body.volume_m3) || !archive.field(body.pressure_pa)) return false;
  // A body may have lost the gas that its scene gave it, but not come by one.
  bool has_gas = body.gas.has_value();
  if (!archive.field(has_gas) || (has_gas && !body.gas)) return false;
  if (!has_gas && body.gas) lose_gas(body);
  if (!archive.field(body.inverted)) return false;
  if (body.gas && !(archive.field(body.gas->moles) && archive.field(body.gas->temperature_ref_k) &&
                    archive.field(body.gas->volume_ref_m3))) {
    return false;
  }
  std::uint64_t grabs = body.grabs.size();
  if (!archive.field(grabs) || grabs > base::body_held_vertices_max) return false;
  body.grabs.resize(grabs);
  for (Grab& grab : body.grabs) {
    if (!grab_fields(archive, grab) || grab.vertex >= body.x.size()) return false;
  }
  return std::ranges::is_sorted(body.grabs, {}, &Grab::vertex);
}

template <class Archive>
bool joint_fields(Archive& archive, JointState& joint) {
  return vector_field(archive, joint.points_m[0]) && vector_field(archive, joint.points_m[1]) &&
         archive.field(joint.turn.w()) && archive.field(joint.turn.x()) && archive.field(joint.turn.y()) &&
         archive.field(joint.turn.z());
}

std::uint64_t hash_of(const std::string& name) {
  Hasher hasher;
  for (const char letter : name) hasher.field(letter);
  return hasher.hash;
}

// A world without joints has none of these. Those that broke are in its scene, but not among these: each tells its
// name.
template <class Archive>
bool joints_fields(Archive& archive, Simulation& sim) {
  const bool is_held = archive.has_more(!sim.joints.empty() || !sim.warm.empty());
  std::uint64_t count = is_held ? sim.joints.size() : 0;
  if (is_held && !archive.field(count)) return false;
  if (count > sim.joints.size()) return false;
  std::size_t next = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint64_t name = next < sim.joints.size() ? hash_of(sim.joints[next].joint.name) : 0;
    if (!archive.field(name)) return false;
    while (next < sim.joints.size() && hash_of(sim.joints[next].joint.name) != name) sim.joints[next++].broken = true;
    if (next == sim.joints.size() || !joint_fields(archive, sim.joints[next++])) return false;
  }
  while (next < sim.joints.size()) sim.joints[next++].broken = true;
  return true;
}

// None but in a world that steps by an implicit method, and is in contact.
template <class Archive>
bool warm_fields(Archive& archive, Simulation& sim) {
  if (!archive.has_more(!sim.warm.empty())) {
    sim.warm.clear();
    return true;
  }
  std::uint64_t count = sim.warm.size();
  if (!archive.field(count) || !archive.can_hold(count, sizeof(WarmImpulse))) return false;
  sim.warm.resize(count);
  for (WarmImpulse& warm : sim.warm) {
    if (!archive.field(warm.key.bodies) || !archive.field(warm.key.features) ||
        !vector_field(archive, warm.impulse_n_s) || !warm.impulse_n_s.allFinite()) {
      return false;
    }
  }
  return std::ranges::is_sorted(sim.warm, {}, &WarmImpulse::key);
}

template <class Archive>
bool state_fields(Archive& archive, Simulation& sim) {
  if (!archive.field(sim.tick) || !archive.field(sim.time_base_s) || !archive.field(sim.tick_base)) return false;
  const bool soft_done = sim.visit([&]<class Real>(SoftBodies<Real>& bodies) {
    if (!archive.count(sizeof(Real)) || !archive.count(bodies.states.size())) return false;
    for (SoftState<Real>& body : bodies.states) {
      if (!soft_fields(archive, body)) return false;
    }
    return true;
  });
  if (!soft_done || !archive.count(sim.rigid.size())) return false;
  for (RigidState& body : sim.rigid) {
    const auto place_fields = [&] { return pose_fields(archive, body.place, body.place_orientation); };
    const auto near_fields = [&] { return pose_fields(archive, body.near_place, body.near_orientation); };
    if (!pose_fields(archive, body.position, body.orientation) || !vector_field(archive, body.velocity) ||
        !vector_field(archive, body.angular_velocity) || !standing_fields(archive, body, place_fields, near_fields)) {
      return false;
    }
  }
  if (!archive.count(sim.colliders.size())) return false;
  for (ColliderState& collider : sim.colliders) {
    if (!pose_fields(archive, collider.position, collider.orientation)) return false;
  }
  return joints_fields(archive, sim) && warm_fields(archive, sim);
}

}  // namespace

std::string World::snapshot() const {
  Writer writer;
  state_fields(writer, *simulation_);
  return std::move(writer.bytes);
}

base::Status World::restore(std::string_view snapshot) {
  auto restored = std::make_unique<Simulation>(*simulation_);
  Reader reader(snapshot);
  if (!state_fields(reader, *restored) || !reader.rest.empty()) {
    return {base::StatusCode::malformed, "the snapshot does not belong to this scene, or is damaged"};
  }
  restored->substep_index = 0;
  restored->tick_substeps = 0;
  restored->touches.clear();
  restored->remove_joints([](const JointState& joint) { return joint.broken; });
  restored->visit([](auto& bodies) {
    bodies.contacts = {};
    bodies.notes = {};
  });
  restored->make_plan();  // bodies may have lost their gas
  simulation_ = std::move(restored);
  return {};
}

World World::copy() const {
  World copy(std::make_unique<Simulation>(*simulation_));
  copy.simulation_->visit([](auto& bodies) {
    bodies.contacts = {};
    bodies.notes = {};
  });
  copy.simulation_->make_plan();  // of its own bodies
  return copy;
}

std::uint64_t World::state_hash() const {
  Hasher hasher;
  state_fields(hasher, *simulation_);
  return hasher.hash;
}

}  // namespace pneuma::physics
