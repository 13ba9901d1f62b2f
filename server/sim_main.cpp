// pneuma-sim: the engine with no network. A scene is stepped as fast as it goes, and what was asked for is written.
// Exit codes: 0 done, 1 the work failed, 2 bad usage.
#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "base/limits.h"
#include "base/version.h"
#include "physics/lanes/isa.h"
#include "physics/world.h"
#include "scene_io/load.h"
#include "scene_io/set_path.h"
#include "scene_io/translate.h"
#include "sim_output.h"
#include "usage/usage.h"

namespace {

using pneuma::base::Result;
using pneuma::base::Status;
using pneuma::physics::World;
using pneuma::scene_io::in_scene;
namespace v1 = pneuma::v1;

constexpr int exit_done = 0;
constexpr int exit_failed = 1;
constexpr int exit_usage = 2;

constexpr double seconds_max = 1e9;
constexpr std::size_t threads_max = 256;

struct Flags {
  std::string scene;
  double seconds = 10.0;
  std::optional<v1::Stepping::Integrator> integrator;
  std::optional<std::uint32_t> substeps;
  std::optional<v1::Stepping::Precision> precision;
  std::size_t threads = 1;
  std::string isa;
  std::string csv;
  std::string obj;
  bool hash = false;
  bool profile = false;
  std::vector<std::string> assignments;
};

std::string plain(std::string name) {
  std::erase(name, '_');
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name;
}

/// An enum of the protocol by its names, in any case, with or without underscores. CLI11's own check takes the numbers
/// too, and prints them.
template <class Enum>
CLI::Option* add_enum(CLI::App& app, const std::string& flag, std::optional<Enum>& chosen, const std::string& what) {
  const auto choose = [flag, &chosen](const std::string& text) {
    const auto* type = google::protobuf::GetEnumDescriptor<Enum>();
    std::string names;
    for (int i = 1; i < type->value_count(); ++i) {  // 0 is for unset
      if (plain(type->value(i)->name()) == plain(text)) chosen = static_cast<Enum>(type->value(i)->number());
      names += (i == 1 ? "" : ", ") + type->value(i)->name();
    }
    if (!chosen) throw CLI::ValidationError(flag, "'" + text + "' is none of " + names);
  };
  return app.add_option_function<std::string>(flag, choose, what)->type_name("NAME");
}

std::string not_empty(const std::string& text) {
  return text.empty() ? "must not be empty" : "";
}

void add_flags(CLI::App& app, Flags& flags) {
  app.set_version_flag("--version", "pneuma-sim " + std::string(pneuma::base::version));
  std::string names;
  for (const std::string& name : pneuma::scene_io::builtin_scene_names()) names += (names.empty() ? "" : ", ") + name;
  app.add_option("scene", flags.scene, "A scene file, or one of " + names)
      ->required()
      ->type_name("NAME|FILE")
      ->check(not_empty);
  // CLI::Range lets NaN pass.
  app.add_option("--seconds", flags.seconds, "Simulated time")
      ->capture_default_str()
      ->check([](const std::string& text) {
        double seconds = -1.0;
        const bool good = CLI::detail::lexical_cast(text, seconds) && seconds >= 0.0 && seconds <= seconds_max;
        return good ? std::string() : text + " is not a number of seconds from 0 to 1e9";
      });
  add_enum(app, "--integrator", flags.integrator,
           "EXPLICIT_EULER, MIDPOINT, RK4, SYMPLECTIC_EULER, IMPLICIT_EULER, TR_BDF2, XPBD or AUTO");
  app.add_option("--substeps", flags.substeps, "Integration steps a tick; 0: chosen from the scene's stiffness")
      ->check(CLI::Range(std::uint32_t{0}, pneuma::base::substeps_max));
  add_enum(app, "--precision", flags.precision, "single or double");
  app.add_option("--threads", flags.threads, "Threads that step; the result does not depend on them")
      ->check(CLI::Range(std::size_t{1}, threads_max));
  app.add_option("--isa", flags.isa, "Instruction set, baseline, v3 or v4; the result does not depend on it")
      ->default_str("the best there is")
      ->check(CLI::IsMember({"baseline", "v3", "v4"}));
  app.add_option("--csv", flags.csv,
                 "Write one row a body a tick; - is standard output, and what else is printed goes to standard error")
      ->type_name("FILE")
      ->check(not_empty);
  app.add_option("--obj", flags.obj, "Write each body's shape each tick, as DIR/INDEX-NAME-TICK.obj")
      ->type_name("DIR")
      ->check(not_empty);
  app.add_flag("--hash", flags.hash, "Print the hash of the whole state at the end");
  app.add_flag("--profile", flags.profile, "Print each stage's time, calls and bytes");
  app.add_option("--set", flags.assignments,
                 "Set a field, as in soft_bodies[0].gas.moles=0.5 or soft_bodies.NAME.mass_kg=2")
      ->type_name("PATH=VALUE")
      ->check([](const std::string& text) {
        const std::size_t path_length = text.find('=');
        const bool good = path_length != std::string::npos && path_length > 0;
        return good ? std::string() : "PATH=VALUE is wanted, not '" + text + "'";
      })
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->allow_extra_args(false);
}

Result<World> make_world(const Flags& flags) {
  auto scene = pneuma::scene_io::load_scene(flags.scene);
  if (!scene.ok()) return scene.status();
  for (const std::string& assignment : flags.assignments) {
    if (auto status = pneuma::scene_io::set_path(*scene, assignment); !status.ok()) return status;
  }
  if (flags.integrator) scene->mutable_stepping()->set_integrator(*flags.integrator);
  if (flags.substeps) scene->mutable_stepping()->set_substeps(*flags.substeps);
  if (flags.precision) scene->mutable_stepping()->set_precision(*flags.precision);
  const auto meshes = pneuma::scene_io::MeshLibrary::build(*scene);
  if (!meshes.ok()) return in_scene(meshes.status(), flags.scene);
  for (const auto& [mesh, report] : meshes->mended()) {
    std::fprintf(stderr, "mesh \"%s\" mended: %s\n", mesh.c_str(), pneuma::physics::describe(report).c_str());
  }
  auto built = pneuma::scene_io::to_physics(*scene, *meshes);
  if (!built.ok()) return in_scene(built.status(), flags.scene);
  auto world = World::create(std::move(*built));
  return world.ok() ? std::move(world) : in_scene(world.status(), flags.scene);
}

/// A line that counts up, where somebody watches.
class Progress {
 public:
  void show(const World& world, double seconds) {
    const auto now = std::chrono::steady_clock::now();
    if (!is_terminal_ || now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    std::fprintf(stderr, "\r%.2f of %g s", world.time_s(), seconds);
    shown_ = true;
  }
  void clear() const {
    if (shown_) std::fputs("\r\033[K", stderr);
  }

 private:
  const bool is_terminal_ = ::isatty(STDERR_FILENO) != 0;
  bool shown_ = false;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

struct Outputs {
  std::optional<pneuma::sim::CsvFile> csv;
  std::optional<pneuma::sim::ObjFolder> obj;

  [[nodiscard]] Status open(const Flags& flags) {
    if (!flags.csv.empty()) {
      auto file = pneuma::sim::CsvFile::create(flags.csv);
      if (!file.ok()) return file.status();
      csv = std::move(*file);
    }
    if (!flags.obj.empty()) {
      auto folder = pneuma::sim::ObjFolder::create(flags.obj);
      if (!folder.ok()) return folder.status();
      obj = std::move(*folder);
    }
    return {};
  }
  [[nodiscard]] Status write_tick(const World& world) {
    if (csv) {
      if (auto status = csv->write_tick(world); !status.ok()) return status;
    }
    return obj ? obj->write_tick(world) : Status();
  }
};

void print_event(const World& world, const std::string& body, const char* happened, const std::string& what) {
  std::fprintf(stderr, "tick %llu: body \"%s\" %s: %s\n", static_cast<unsigned long long>(world.tick()), body.c_str(),
               happened, what.c_str());
}

/// Prints what became of bodies in the tick. `frozen` names the first of all that ran away.
void tell_events(World& world, const Progress& progress, Status& frozen) {
  const auto gas_events = world.take_gas_events();
  const auto frozen_bodies = world.take_frozen();
  const auto broken_joints = world.take_broken_joints();
  if (!gas_events.empty() || !frozen_bodies.empty() || !broken_joints.empty()) progress.clear();
  for (const auto& [body, event] : gas_events) {
    const bool burst = event.kind == pneuma::physics::GasEvent::Kind::burst;
    print_event(world, body, burst ? "burst" : "inverted", pneuma::physics::describe(event));
  }
  for (const auto& [joint, force_n] : broken_joints) {
    std::fprintf(stderr, "tick %llu: joint \"%s\" broke: it takes at most %g N\n",
                 static_cast<unsigned long long>(world.tick()), joint.c_str(), force_n);
  }
  for (const auto& body : frozen_bodies) {
    print_event(world, body.name, "frozen", body.reason);
    if (!frozen.ok()) continue;
    frozen = {pneuma::base::StatusCode::failed_precondition,
              "was frozen at tick " + std::to_string(world.tick()) + ": " + body.reason, "body \"" + body.name + "\""};
  }
}

Status run(const Flags& flags) {
  if (!flags.isa.empty()) {
    if (auto status = pneuma::physics::use_isa(flags.isa); !status.ok()) return status;
  }
  auto world = make_world(flags);
  if (!world.ok()) return world.status();
  Outputs outputs;
  if (auto status = outputs.open(flags); !status.ok()) return status;
  world->set_profiling(flags.profile);

  pneuma::physics::Workers workers(flags.threads);
  Progress progress;
  Status frozen;
  const auto tick_count = static_cast<std::uint64_t>(std::llround(flags.seconds / world->tick_period_s()));
  const auto start = std::chrono::steady_clock::now();
  if (auto status = outputs.write_tick(*world); !status.ok()) return status;
  for (std::uint64_t tick = 0; tick < tick_count; ++tick) {
    world->step_tick(workers);
    tell_events(*world, progress, frozen);
    if (auto status = outputs.write_tick(*world); !status.ok()) return status;
    progress.show(*world, flags.seconds);
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  progress.clear();
  if (outputs.csv) {
    if (auto status = outputs.csv->finish(); !status.ok()) return status;
  }

  std::FILE* const report = flags.csv == "-" ? stderr : stdout;  // the rows alone, for a pipe
  if (flags.hash) std::fprintf(report, "hash 0x%016llx\n", static_cast<unsigned long long>(world->state_hash()));
  if (flags.profile) pneuma::sim::print_profile(report, world->profile());
  const bool has_output = flags.hash || flags.profile || !flags.csv.empty() || !flags.obj.empty();
  if (!has_output) pneuma::sim::print_summary(report, *world, wall.count());
  if (std::fflush(stdout) != 0) return {pneuma::base::StatusCode::unavailable, "cannot write", "standard output"};
  return frozen;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Steps a scene of soft bodies under pressure and writes what became of it.", "pneuma-sim");
  Flags flags;
  add_flags(app, flags);
  pneuma::usage::add_generators(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "pneuma-sim: %s\n", pneuma::usage::usage_error(app, error).c_str());
    return exit_usage;
  }
  const Status status = run(flags);
  if (status.ok()) return exit_done;
  std::fprintf(stderr, "pneuma-sim: %s\n", status.message().c_str());
  return exit_failed;
}
