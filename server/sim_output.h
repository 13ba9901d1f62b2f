// What pneuma-sim writes: measures as CSV, shapes as OBJ, and tables for people.
#pragma once

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "base/status.h"
#include "physics/choice/step_choice.h"
#include "physics/world.h"

namespace pneuma::sim {

/// One row a soft body a tick; numbers with 17 digits, so that reading them back gives the same bits.
class CsvFile {
 public:
  /// "-" is standard output.
  [[nodiscard]] static base::Result<CsvFile> create(const std::string& path);
  [[nodiscard]] base::Status write_tick(const physics::World& world);
  /// What the system still held back is on its way, or this says why not.
  [[nodiscard]] base::Status finish();

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  CsvFile(std::FILE* file, std::string path) : file_(file), path_(std::move(path)) {}

  std::unique_ptr<std::FILE, Closer> file_;
  std::string path_;
};

/// One file a soft body a tick, FOLDER/INDEX-NAME-TICK.obj.
class ObjFolder {
 public:
  /// Makes the folder where there is none.
  [[nodiscard]] static base::Result<ObjFolder> create(const std::string& path);
  [[nodiscard]] base::Status write_tick(const physics::World& world) const;

 private:
  explicit ObjFolder(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

/// Every stage, also those that the scene left out.
void print_profile(std::FILE* out, const physics::Profile& profile);

void print_summary(std::FILE* out, const physics::World& world, double wall_s);

}  // namespace pneuma::sim
