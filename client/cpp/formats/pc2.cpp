#include <cstdint>
#include <fstream>

#include "base/byte_order.h"
#include "formats/exporter.h"

namespace pneuma::client {

namespace {

class Pc2Exporter final : public Exporter {
 public:
  explicit Pc2Exporter(const ExportPlan& plan) : plan_(plan) {}

  base::Status add(const Sample& sample) override {
    if (sample.index == 0) {
      if (base::Status begun = begin(sample); !begun.ok()) return begun;
    } else if (base::Status same = check_same_bodies(first_, sample); !same.ok()) {
      return same;
    }
    for (std::size_t body = 0; body < files_.size(); ++body) {
      std::string bytes;
      for (const double coordinate_m : sample.bodies[body].positions_m) {
        base::append_number(bytes, static_cast<float>(coordinate_m));
      }
      if (!(files_[body].out << bytes)) return write_failure(files_[body].path);
    }
    return {};
  }

  base::Status finish() override {
    for (File& file : files_) {
      file.out.close();
      if (!file.out) return write_failure(file.path);
    }
    return {};
  }

 private:
  struct File {
    std::string path;
    std::ofstream out;
  };

  base::Status begin(const Sample& sample) {
    first_ = sample.bodies;
    const std::vector<std::string> names = file_names(first_, ".-");
    for (std::size_t body = 0; body < first_.size(); ++body) {
      const std::string stem = plan_.out + "/" + names[body];
      if (base::Status written = write_obj({first_[body]}, stem + ".obj"); !written.ok()) return written;
      std::string header("POINTCACHE2\0", 12);
      base::append_number(header, std::uint32_t{1});  // version
      base::append_number(header, static_cast<std::uint32_t>(first_[body].positions_m.size() / 3));
      base::append_number(header, 0.0F);  // first frame
      base::append_number(header, 1.0F);  // frames a sample
      base::append_number(header, static_cast<std::uint32_t>(plan_.samples));
      File& file = files_.emplace_back(stem + ".pc2", std::ofstream(stem + ".pc2", std::ios::binary));
      if (!(file.out << header)) return write_failure(file.path);
    }
    return {};
  }

  ExportPlan plan_;
  std::vector<SoftBodyFrame> first_;
  std::vector<File> files_;
};

}  // namespace

base::Result<std::unique_ptr<Exporter>> export_pc2(const ExportPlan& plan) {
  if (base::Status made = make_folder(plan.out); !made.ok()) return made;
  return std::unique_ptr<Exporter>(std::make_unique<Pc2Exporter>(plan));
}

}  // namespace pneuma::client
