#include "sim_output.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <utility>

#include <unistd.h>

namespace pneuma::sim {
namespace {

base::Status failure(const char* verb, const std::string& path, int error) {
  return {base::StatusCode::unavailable, std::string("cannot ") + verb + ": " + std::generic_category().message(error),
          path};
}

/// As RFC 4180 has it: in quotes where it must be.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

/// A body's name as part of a file's: what is not plain becomes an underscore.
std::string file_part(std::string name) {
  for (char& c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    if (!plain) c = '_';
  }
  return name;
}

bool write_obj(std::FILE* file, const std::vector<double>& positions_m, const physics::Mesh& mesh) {
  for (std::size_t i = 0; i < positions_m.size(); i += 3) {
    std::fprintf(file, "v %.9g %.9g %.9g\n", positions_m[i], positions_m[i + 1], positions_m[i + 2]);
  }
  for (const physics::Face& face : mesh.faces)
    std::fprintf(file, "f %u %u %u\n", face[0] + 1, face[1] + 1, face[2] + 1);
  return std::ferror(file) == 0;
}

}  // namespace

base::Result<CsvFile> CsvFile::create(const std::string& path) {
  const bool is_standard_output = path == "-";
  const std::string name = is_standard_output ? "standard output" : path;
  std::FILE* file = is_standard_output ? ::fdopen(::dup(STDOUT_FILENO), "w") : std::fopen(path.c_str(), "we");
  if (file == nullptr) return failure("write", name, errno);
  CsvFile csv(file, name);
  std::fputs(
      "tick,time_s,body,volume_m3,area_m2,pressure_pa,kinetic_j,elastic_j,gas_j,gravity_j,px,py,pz,lx,ly,lz,"
      "com_x,com_y,com_z,max_speed_m_s,temperature_k,moles\n",
      file);
  return csv;
}

base::Status CsvFile::write_tick(const physics::World& world) {
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    const physics::BodyMeasures m = world.measure(i);
    std::fprintf(file_.get(), "%llu,%.17g,%s", static_cast<unsigned long long>(world.tick()), world.time_s(),
                 csv_field(world.soft_body(i).name).c_str());
    const std::array columns{m.volume_m3,
                             m.area_m2,
                             m.pressure_pa,
                             m.kinetic_j,
                             m.elastic_j,
                             m.gas_j,
                             m.gravity_j,
                             m.momentum.x(),
                             m.momentum.y(),
                             m.momentum.z(),
                             m.angular_momentum.x(),
                             m.angular_momentum.y(),
                             m.angular_momentum.z(),
                             m.centre_of_mass.x(),
                             m.centre_of_mass.y(),
                             m.centre_of_mass.z(),
                             m.max_speed_m_s,
                             m.temperature_k,
                             m.moles};
    for (const double value : columns) std::fprintf(file_.get(), ",%.17g", value);
    std::fputc('\n', file_.get());
  }
  return std::ferror(file_.get()) == 0 ? base::Status() : failure("write", path_, errno);
}

base::Status CsvFile::finish() {
  return std::fflush(file_.get()) == 0 ? base::Status() : failure("write", path_, errno);
}

base::Result<ObjFolder> ObjFolder::create(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return failure("make the folder", path, error.value());
  return ObjFolder(path);
}

base::Status ObjFolder::write_tick(const physics::World& world) const {
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    const physics::SoftBody& body = world.soft_body(i);
    std::array<char, 32> tick{};
    std::snprintf(tick.data(), tick.size(), "%06llu", static_cast<unsigned long long>(world.tick()));
    const std::string path = path_ + "/" + std::to_string(i) + "-" + file_part(body.name) + "-" + tick.data() + ".obj";
    std::vector<double> positions_m(3 * body.mesh->positions_m.size());
    world.copy_positions(i, positions_m);
    std::FILE* file = std::fopen(path.c_str(), "we");
    if (file == nullptr) return failure("write", path, errno);
    const bool written = write_obj(file, positions_m, *body.mesh);
    const int write_error = errno;
    if (std::fclose(file) != 0 || !written) return failure("write", path, written ? errno : write_error);
  }
  return {};
}

void print_profile(std::FILE* out, const physics::Profile& profile) {
  std::fprintf(out, "%-14s %12s %12s %12s\n", "stage", "time_ms", "calls", "bytes");
  for (std::size_t i = 0; i < profile.size(); ++i) {
    const physics::StageRow& row = profile[i];
    const double time_ms = std::chrono::duration<double, std::milli>(row.time).count();
    std::fprintf(out, "%-14.*s %12.3f %12llu %12llu\n", static_cast<int>(physics::stage_names[i].size()),
                 physics::stage_names[i].data(), time_ms, static_cast<unsigned long long>(row.calls),
                 static_cast<unsigned long long>(row.bytes));
  }
}

void print_summary(std::FILE* out, const physics::World& world, double wall_s) {
  std::fprintf(out, "%llu ticks, %g s simulated in %.3f s: %.1f times real time\n",
               static_cast<unsigned long long>(world.tick()), world.time_s(), wall_s,
               wall_s > 0.0 ? world.time_s() / wall_s : 0.0);
  const std::string_view integrator = physics::name_of(world.integrator());
  std::fprintf(out, "%.*s, %u substeps a tick: %s\n", static_cast<int>(integrator.size()), integrator.data(),
               world.substeps(), world.substeps_reason().c_str());
  if (world.soft_body_count() == 0) return;
  std::fprintf(out, "%-20s %9s %14s %14s %14s\n", "body", "vertices", "volume_m3", "pressure_pa", "max_speed_m_s");
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    const physics::SoftBody& body = world.soft_body(i);
    const physics::BodyMeasures measures = world.measure(i);
    std::fprintf(out, "%-20s %9zu %14.6g %14.6g %14.6g%s\n", body.name.c_str(), body.mesh->positions_m.size(),
                 measures.volume_m3, measures.pressure_pa, measures.max_speed_m_s,
                 world.is_frozen(i)   ? "  (frozen)"
                 : world.is_asleep(i) ? "  (asleep)"
                                      : "");
  }
}

}  // namespace pneuma::sim
