#include "physics/fleet.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

#include "base/limits.h"

namespace pneuma::physics {

namespace {

using base::Status;

/// The row of a world, of a table with so many columns; empty of an empty table.
template <class T>
std::span<T> row(std::span<T> table, std::size_t index, std::size_t columns) {
  return table.empty() ? table : table.subspan(index * columns, columns);
}

Vec3d vector_at(std::span<const double> numbers, std::size_t index) {
  return {numbers[3 * index], numbers[3 * index + 1], numbers[3 * index + 2]};
}

void put_vector(const Vec3d& vector, std::span<double> numbers, std::size_t index) {
  for (std::size_t axis = 0; axis < 3; ++axis) numbers[3 * index + axis] = vector[static_cast<Eigen::Index>(axis)];
}

std::string element(const std::string& list, std::size_t index) {
  return list + "[" + std::to_string(index) + "]";
}

/// Sets `velocity` to the row's, unless that is NaN. Whether it is another one. Refuses one that is NaN in part.
base::Result<bool> take_velocity(std::span<const double> velocities, const char* name, std::size_t index,
                                 Vec3d& velocity) {
  if (velocities.empty()) return false;
  const Vec3d wanted = vector_at(velocities, index);
  if (wanted.array().isNaN().all() || wanted == velocity) return false;
  if (wanted.hasNaN()) {
    return base::invalid("is NaN in part; a collider is left as it is where all three are", element(name, index));
  }
  velocity = wanted;
  return true;
}

}  // namespace

base::Result<Fleet> Fleet::create(Scene scene, std::size_t count, std::size_t threads) {
  assert(count > 0 && threads > 0);
  base::Result<World> start = World::create(std::move(scene));
  if (!start.ok()) return start.status();
  return Fleet(std::move(*start), count, threads);
}

Fleet::Fleet(World start, std::size_t count, std::size_t threads)
    : start_(std::move(start)), threads_(std::make_unique<Workers>(threads)), batches_(threads) {
  WorldBatch::prepare(start_);
  for (std::size_t i = 0; i < start_.soft_body_count(); ++i) {
    body_names_.push_back(start_.soft_body(i).name);
    vertex_count_ += start_.soft_body(i).mesh->positions_m.size();
  }
  for (const RigidState& state : start_.rigid_bodies()) body_names_.push_back(state.body.name);
  worlds_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) worlds_.push_back(start_.copy());
}

Status Fleet::step(std::uint32_t ticks, const FleetActions& actions, const FleetView& view) {
  std::mutex refusing;
  std::optional<std::pair<std::size_t, Status>> refused;  // of the first world that was, whichever thread had it
  const std::size_t threads = threads_->threads();
  // As many worlds at a time as lanes take, where each thread still has some.
  const std::size_t run = std::clamp<std::size_t>(count() / threads, 1, pack_slots);
  std::atomic<std::size_t> next{0};
  threads_->for_each(threads, [&](std::size_t thread) {
    std::vector<World*> acted;
    for (std::size_t begin = next.fetch_add(run); begin < count(); begin = next.fetch_add(run)) {
      const std::size_t end = std::min(begin + run, count());
      acted.clear();
      for (std::size_t i = begin; i < end; ++i) {
        if (Status wrong = act(i, actions); wrong.ok()) {
          acted.push_back(&worlds_[i]);
        } else {
          const std::lock_guard lock(refusing);
          if (!refused || i < refused->first) refused.emplace(i, wrong.inside("worlds[" + std::to_string(i) + "]"));
        }
      }
      for (std::uint32_t tick = 0; tick < ticks; ++tick) batches_[thread].step_tick(acted);
      // Shown while they are in this core's cache.
      for (const World* world : acted) show(static_cast<std::size_t>(world - worlds_.data()), view);
    }
  });
  return refused ? refused->second : Status();
}

void Fleet::reset(std::span<const std::uint8_t> which, const FleetView& view) {
  assert(which.size() == count());
  threads_->for_each(count(), [&](std::size_t i) {
    if (which[i] != 0) worlds_[i] = start_.copy();
    show(i, view);
  });
}

Status Fleet::act(std::size_t index, const FleetActions& actions) {
  const Status wrong = change(index, actions);
  return wrong.ok() ? push(index, actions) : wrong;
}

Status Fleet::push(std::size_t index, const FleetActions& actions) {
  World& world = worlds_[index];
  const std::span<const double> impulses_n_s = row(actions.impulses_n_s, index, 3 * body_count());
  if (impulses_n_s.empty()) return {};
  const std::size_t soft_count = world.soft_body_count();
  for (std::size_t body = 0; body < body_count(); ++body) {
    const Vec3d impulse_n_s = vector_at(impulses_n_s, body);
    if (impulse_n_s.isZero(0.0)) continue;
    // Not-a-number is no impulse within the limit, either.
    if (!(impulse_n_s.cwiseAbs().maxCoeff() <= base::impulse_max_n_s) || !impulse_n_s.allFinite()) {
      return base::invalid("is not finite, or past the limit", element("impulses", body));
    }
    const bool frozen = body < soft_count ? world.is_frozen(body) : world.rigid_bodies()[body - soft_count].frozen;
    if (frozen) continue;
    if (const auto hit = world.apply_impulse(body_names_[body], WholeBody{}, impulse_n_s); !hit.ok()) {
      return hit.status().inside(element("impulses", body));
    }
  }
  return {};
}

// By an edit, so that all that follows from one is so: who wakes, and how many substeps a stiffer gas needs.
Status Fleet::change(std::size_t index, const FleetActions& actions) {
  World& world = worlds_[index];
  const auto moles = row(actions.moles, index, world.soft_body_count());
  const auto velocities = row(actions.collider_velocities_m_s, index, 3 * world.colliders().size());
  const auto spins = row(actions.collider_angular_velocities_rad_s, index, 3 * world.colliders().size());
  if (moles.empty() && velocities.empty() && spins.empty()) return {};
  Scene wanted = world.scene();
  bool changed = false;
  for (std::size_t body = 0; body < moles.size(); ++body) {
    if (std::isnan(moles[body])) continue;
    if (!start_.soft_body(body).gas) {
      return base::Status(base::StatusCode::failed_precondition,
                          "\"" + body_names_[body] + "\" has no gas; NaN leaves a body as it is",
                          element("moles", body));
    }
    // Live: what a gas holds now, leaks and flows counted. None where it burst its body.
    std::optional<Gas>& gas = wanted.soft_bodies[body].gas;
    if (!gas || gas->moles == moles[body]) continue;
    gas->moles = moles[body];
    changed = true;
  }
  for (std::size_t i = 0; i < wanted.colliders.size(); ++i) {
    const auto moved = take_velocity(velocities, "collider_velocities", i, wanted.colliders[i].velocity);
    if (!moved.ok()) return moved.status();
    const auto turned = take_velocity(spins, "collider_angular_velocities", i, wanted.colliders[i].angular_velocity);
    if (!turned.ok()) return turned.status();
    changed |= *moved || *turned;
  }
  return changed ? world.apply(std::move(wanted)) : Status();
}

void Fleet::show(std::size_t index, const FleetView& view) const {
  show_vertices(index, view);
  show_bodies(index, view);
  if (!view.ticks.empty()) view.ticks[index] = worlds_[index].tick();
}

void Fleet::show_vertices(std::size_t index, const FleetView& view) const {
  const World& world = worlds_[index];
  const auto positions_m = row(view.positions_m, index, 3 * vertex_count_);
  const auto velocities_m_s = row(view.velocities_m_s, index, 3 * vertex_count_);
  std::vector<double> numbers;
  const auto put = [&numbers](std::span<float> out, std::size_t begin) {
    std::ranges::transform(numbers, out.begin() + static_cast<std::ptrdiff_t>(begin),
                           [](double number) { return static_cast<float>(number); });
  };
  std::size_t begin = 0;
  for (std::size_t body = 0; body < world.soft_body_count(); ++body) {
    numbers.resize(3 * world.soft_body(body).mesh->positions_m.size());
    if (!positions_m.empty()) {
      world.copy_positions(body, numbers);
      put(positions_m, begin);
    }
    if (!velocities_m_s.empty()) {
      world.copy_velocities(body, numbers);
      put(velocities_m_s, begin);
    }
    begin += numbers.size();
  }
}

void Fleet::show_bodies(std::size_t index, const FleetView& view) const {
  const World& world = worlds_[index];
  const std::size_t soft_count = world.soft_body_count();
  const auto centres_m = row(view.centres_of_mass_m, index, 3 * body_count());
  const auto velocities_m_s = row(view.mean_velocities_m_s, index, 3 * body_count());
  const auto pressures_pa = row(view.pressures_pa, index, soft_count);
  const auto volumes_m3 = row(view.volumes_m3, index, soft_count);
  const auto frozen = row(view.frozen, index, body_count());
  const bool measured = !centres_m.empty() || !velocities_m_s.empty() || !pressures_pa.empty() || !volumes_m3.empty();
  for (std::size_t body = 0; body < soft_count; ++body) {
    if (!frozen.empty()) frozen[body] = world.is_frozen(body);
    if (!measured) continue;
    const BodyMeasures measures = world.measure_motion(body);
    if (!centres_m.empty()) put_vector(measures.centre_of_mass, centres_m, body);
    if (!velocities_m_s.empty()) {
      put_vector(measures.momentum / world.soft_body(body).mass_kg, velocities_m_s, body);
    }
    if (!pressures_pa.empty()) pressures_pa[body] = measures.pressure_pa;
    if (!volumes_m3.empty()) volumes_m3[body] = measures.volume_m3;
  }
  for (std::size_t i = 0; i < world.rigid_bodies().size(); ++i) {
    const RigidState& state = world.rigid_bodies()[i];
    const std::size_t body = soft_count + i;
    if (!frozen.empty()) frozen[body] = state.frozen;
    if (!centres_m.empty()) put_vector(state.position, centres_m, body);
    if (!velocities_m_s.empty()) put_vector(state.velocity, velocities_m_s, body);
  }
}

}  // namespace pneuma::physics
