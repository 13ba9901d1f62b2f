// Worlds in Python's own process.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "app/local_world.h"
#include "app/machine_memory.h"
#include "app/scene_source.h"
#include "messages.h"
#include "module.h"
#include "physics/fleet.h"
#include "scene_io/translate.h"

namespace pneuma::python {

namespace py = pybind11;

namespace {

v1::Scene scene_in(std::string_view create_world) {
  return checked(app::scene_of(parsed<v1::CreateWorld>(create_world)));
}

// More cores than one machine has. Each thread takes a stack, and who asks for more has mixed up two numbers.
constexpr std::size_t threads_max = 1'024;

std::size_t checked_threads(std::size_t threads) {
  if (threads == 0 || threads > threads_max) {
    raise(base::invalid("is " + std::to_string(threads) + "; 1 to " + std::to_string(threads_max) + " can be",
                        "threads"));
  }
  return threads;
}

/// One world. Calls of several threads wait for each other.
class OneWorld {
 public:
  OneWorld(std::string_view create_world, std::size_t threads)
      : world_(checked(app::LocalWorld::create(scene_in(create_world), checked_threads(threads)))) {}

  py::bytes answer(std::string_view request) {
    const auto message = parsed<v1::ClientMessage>(request);
    std::string reply;
    {
      const py::gil_scoped_release others_run;
      const std::lock_guard lock(mutex_);
      reply = world_.answer(message).SerializeAsString();
    }
    return {reply};
  }
  [[nodiscard]] std::uint64_t tick() {
    const py::gil_scoped_release others_run;
    const std::lock_guard lock(mutex_);
    return world_.live().tick();
  }
  [[nodiscard]] std::uint64_t state_hash() {
    const py::gil_scoped_release others_run;
    const std::lock_guard lock(mutex_);
    return world_.live().physics().state_hash();
  }

 private:
  std::mutex mutex_;
  app::LocalWorld world_;
};

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Shape = std::vector<py::ssize_t>;

/// As Python writes a shape.
std::string text_of(std::span<const py::ssize_t> shape) {
  std::string text;
  for (const py::ssize_t size : shape) text += (text.empty() ? "" : ", ") + std::to_string(size);
  return "(" + text + (shape.size() == 1 ? ",)" : ")");
}

std::span<const py::ssize_t> shape_of(const py::array& array) {
  return {array.shape(), static_cast<std::size_t>(array.ndim())};
}

void check_shape(const py::array& array, const Shape& shape, const char* name) {
  if (std::ranges::equal(shape_of(array), shape)) return;
  raise(base::invalid("has the shape " + text_of(shape_of(array)) + ", not " + text_of(shape), name));
}

/// The array's numbers, where it has the shape; none of None.
std::span<const double> numbers_of(const std::optional<Numbers>& array, const Shape& shape, const char* name) {
  if (!array) return {};
  check_shape(*array, shape, name);
  return {array->data(), static_cast<std::size_t>(array->size())};
}

/// One for each that is true. Numbers are refused: an index would pass for a flag.
std::vector<std::uint8_t> flags_of(const py::object& given, py::ssize_t count, const char* name) {
  const auto array = py::array::ensure(given, py::array::c_style);
  if (!array) raise(base::invalid("is no array of bool", name));
  if (array.dtype().kind() != 'b') {
    raise(base::invalid("is an array of " + std::string(py::str(array.dtype())) + ", not of bool", name));
  }
  check_shape(array, {count}, name);
  const auto flags = py::array_t<bool>(array);
  return {flags.data(), flags.data() + flags.size()};
}

template <class T>
std::span<T> span_of(std::optional<py::array_t<T>>& array) {
  if (!array) return {};
  return {array->mutable_data(), static_cast<std::size_t>(array->size())};
}

/// Many worlds, and the arrays that show them: made once, and written by every step and reset.
class ManyWorlds {
 public:
  ManyWorlds(std::string_view create_world, std::size_t count, std::size_t threads, const std::set<std::string>& shown)
      : fleet_(make(create_world, count, threads)) {
    const physics::World& world = fleet_.world(0);
    for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
      vertex_counts_.push_back(world.soft_body(i).mesh->positions_m.size());
    }
    for (const auto& state : world.colliders()) collider_names_.push_back(state.collider.name);
    const auto bodies = static_cast<py::ssize_t>(fleet_.body_count());
    const auto soft = static_cast<py::ssize_t>(world.soft_body_count());
    const auto vertices = static_cast<py::ssize_t>(fleet_.vertex_count());
    const auto rows = static_cast<py::ssize_t>(count);
    const auto make_array = [&]<class T>(const char* name, std::optional<py::array_t<T>>& array, const Shape& shape) {
      if (shown.contains(name)) array.emplace(shape);
    };
    make_array("positions", positions, {rows, vertices, 3});
    make_array("velocities", velocities, {rows, vertices, 3});
    make_array("centres_of_mass", centres_of_mass, {rows, bodies, 3});
    make_array("mean_velocities", mean_velocities, {rows, bodies, 3});
    make_array("pressures_pa", pressures_pa, {rows, soft});
    make_array("volumes_m3", volumes_m3, {rows, soft});
    frozen.emplace(Shape{rows, bodies});
    ticks.emplace(Shape{rows});
    fleet_.reset(std::vector<std::uint8_t>(count), view());
  }

  void step(std::uint32_t ticks_done, const std::optional<Numbers>& impulses, const std::optional<Numbers>& moles,
            const std::optional<Numbers>& collider_velocities,
            const std::optional<Numbers>& collider_angular_velocities) {
    const auto rows = static_cast<py::ssize_t>(fleet_.count());
    const auto soft = static_cast<py::ssize_t>(vertex_counts_.size());
    const auto solids = static_cast<py::ssize_t>(collider_names_.size());
    const physics::FleetActions actions{
        .impulses_n_s = numbers_of(impulses, {rows, static_cast<py::ssize_t>(fleet_.body_count()), 3}, "impulses"),
        .moles = numbers_of(moles, {rows, soft}, "moles"),
        .collider_velocities_m_s = numbers_of(collider_velocities, {rows, solids, 3}, "collider_velocities"),
        .collider_angular_velocities_rad_s =
            numbers_of(collider_angular_velocities, {rows, solids, 3}, "collider_angular_velocities")};
    const physics::FleetView shown = view();
    base::Status status;
    {
      const py::gil_scoped_release others_run;
      const std::lock_guard lock(mutex_);
      status = fleet_.step(ticks_done, actions, shown);
    }
    check(status);
  }

  void reset(const py::object& which) {
    const std::vector<std::uint8_t> wanted = flags_of(which, static_cast<py::ssize_t>(fleet_.count()), "which");
    const physics::FleetView shown = view();
    const py::gil_scoped_release others_run;
    const std::lock_guard lock(mutex_);
    fleet_.reset(wanted, shown);
  }

  py::array_t<std::uint64_t> state_hashes() {
    py::array_t<std::uint64_t> hashes(static_cast<py::ssize_t>(fleet_.count()));
    std::uint64_t* out = hashes.mutable_data();
    const py::gil_scoped_release others_run;
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < fleet_.count(); ++i) out[i] = fleet_.world(i).state_hash();
    return hashes;
  }

  [[nodiscard]] std::size_t count() const { return fleet_.count(); }
  [[nodiscard]] double tick_s() const { return fleet_.world(0).tick_period_s(); }
  [[nodiscard]] const std::vector<std::string>& body_names() const { return fleet_.body_names(); }
  [[nodiscard]] const std::vector<std::string>& collider_names() const { return collider_names_; }
  [[nodiscard]] const std::vector<std::size_t>& vertex_counts() const { return vertex_counts_; }

  std::optional<py::array_t<float>> positions;
  std::optional<py::array_t<float>> velocities;
  std::optional<py::array_t<double>> centres_of_mass;
  std::optional<py::array_t<double>> mean_velocities;
  std::optional<py::array_t<double>> pressures_pa;
  std::optional<py::array_t<double>> volumes_m3;
  std::optional<py::array_t<bool>> frozen;
  std::optional<py::array_t<std::uint64_t>> ticks;

 private:
  static physics::Fleet make(std::string_view create_world, std::size_t count, std::size_t threads) {
    if (count == 0) raise(base::invalid("must be 1 or more", "count"));
    physics::Scene scene = checked(scene_io::to_physics(scene_in(create_world)));
    check_memory(scene, count);
    return checked(physics::Fleet::create(std::move(scene), count, checked_threads(threads)));
  }
  // By what no world does without, so that nothing is refused that may fit: places, velocities and moves.
  static void check_memory(const physics::Scene& scene, std::size_t count) {
    const bool is_single = scene.stepping.precision == physics::Precision::single_precision;
    const double least_bytes_a_vertex = 9.0 * (is_single ? sizeof(float) : sizeof(double));
    constexpr double least_bytes = 4.0 * 1024;
    double vertices = 0.0;
    for (const physics::SoftBody& body : scene.soft_bodies) {
      vertices += static_cast<double>(body.mesh->positions_m.size());
    }
    const auto most = static_cast<double>(app::machine_memory_bytes());
    const double least = static_cast<double>(count) * (least_bytes + least_bytes_a_vertex * vertices);
    if (least <= most) return;
    const auto mib = [](double bytes) { return std::to_string(static_cast<std::uint64_t>(bytes / (1024.0 * 1024.0))); };
    raise({base::StatusCode::limit_exceeded,
           std::to_string(count) + " worlds take " + mib(least) + " MiB or more; there are " + mib(most), "count"});
  }
  physics::FleetView view() {
    return {.positions_m = span_of(positions),
            .velocities_m_s = span_of(velocities),
            .centres_of_mass_m = span_of(centres_of_mass),
            .mean_velocities_m_s = span_of(mean_velocities),
            .pressures_pa = span_of(pressures_pa),
            .volumes_m3 = span_of(volumes_m3),
            .frozen = span_of(frozen),
            .ticks = span_of(ticks)};
  }

  std::mutex mutex_;
  physics::Fleet fleet_;
  std::vector<std::size_t> vertex_counts_;
  std::vector<std::string> collider_names_;
};

}  // namespace

void add_worlds(py::module_& module) {
  using py::literals::operator""_a;
  py::class_<OneWorld>(module, "World")
      .def(py::init<std::string_view, std::size_t>(), "create_world"_a, "threads"_a)
      .def("answer", &OneWorld::answer, "request"_a)
      .def_property_readonly("tick", &OneWorld::tick)
      .def_property_readonly("state_hash", &OneWorld::state_hash);
  py::class_<ManyWorlds>(module, "Worlds")
      .def(py::init<std::string_view, std::size_t, std::size_t, const std::set<std::string>&>(), "create_world"_a,
           "count"_a, "threads"_a, "shown"_a)
      .def("step", &ManyWorlds::step, "ticks"_a, "impulses"_a, "moles"_a, "collider_velocities"_a,
           "collider_angular_velocities"_a)
      .def("reset", &ManyWorlds::reset, "which"_a)
      .def("state_hashes", &ManyWorlds::state_hashes)
      .def_property_readonly("count", &ManyWorlds::count)
      .def_property_readonly("tick_s", &ManyWorlds::tick_s)
      .def_property_readonly("body_names", &ManyWorlds::body_names)
      .def_property_readonly("collider_names", &ManyWorlds::collider_names)
      .def_property_readonly("vertex_counts", &ManyWorlds::vertex_counts)
      .def_readonly("positions", &ManyWorlds::positions)
      .def_readonly("velocities", &ManyWorlds::velocities)
      .def_readonly("centres_of_mass", &ManyWorlds::centres_of_mass)
      .def_readonly("mean_velocities", &ManyWorlds::mean_velocities)
      .def_readonly("pressures_pa", &ManyWorlds::pressures_pa)
      .def_readonly("volumes_m3", &ManyWorlds::volumes_m3)
      .def_readonly("frozen", &ManyWorlds::frozen)
      .def_readonly("ticks", &ManyWorlds::ticks);
}

}  // namespace pneuma::python
