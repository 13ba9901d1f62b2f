#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "formats/exporter.h"

namespace pneuma::client {

base::Status write_obj(const std::vector<SoftBodyFrame>& bodies, const std::string& path) {
  std::ofstream out(path);
  out.precision(9);
  std::size_t first = 1;
  for (const SoftBodyFrame& body : bodies) {
    out << "o " << body.name << '\n';
    for (std::size_t i = 0; i + 2 < body.positions_m.size(); i += 3) {
      out << "v " << body.positions_m[i] << ' ' << body.positions_m[i + 1] << ' ' << body.positions_m[i + 2] << '\n';
    }
    const auto& indices = body.topology->indices;
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      out << "f " << first + indices[i] << ' ' << first + indices[i + 1] << ' ' << first + indices[i + 2] << '\n';
    }
    first += body.positions_m.size() / 3;
  }
  out.close();
  return out ? base::Status() : write_failure(path);
}

namespace {

class ObjExporter final : public Exporter {
 public:
  explicit ObjExporter(std::string folder) : folder_(std::move(folder)) {}
  base::Status add(const Sample& sample) override {
    count_ = sample.index + 1;
    return write_obj(sample.bodies, path_of(sample.index));
  }
  /// What a longer export left behind goes, or it would be taken for the end of this one.
  base::Status finish() override {
    std::error_code error;
    for (std::size_t index = count_; std::filesystem::remove(path_of(index), error); ++index) {
    }
    return error ? base::Status(base::StatusCode::unavailable, error.message(), folder_) : base::Status();
  }

 private:
  [[nodiscard]] std::string path_of(std::size_t index) const {
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "/frame-%06zu.obj", index);
    return folder_ + name.data();
  }

  std::string folder_;
  std::size_t count_ = 0;
};

}  // namespace

base::Result<std::unique_ptr<Exporter>> export_obj(const ExportPlan& plan) {
  if (base::Status made = make_folder(plan.out); !made.ok()) return made;
  return std::unique_ptr<Exporter>(std::make_unique<ObjExporter>(plan.out));
}

}  // namespace pneuma::client
