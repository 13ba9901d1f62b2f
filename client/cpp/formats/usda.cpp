#include <array>
#include <charconv>
#include <fstream>

#include "command/json.h"
#include "formats/exporter.h"
#include "formats/scratch_file.h"

namespace pneuma::client {

namespace {

/// The shortest text that reads back as the same float.
void append_float(std::string& out, double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), static_cast<float>(value)).ptr;
  out.append(text.data(), end);
}

std::string points_text(const std::vector<double>& positions_m) {
  std::string text = "[";
  for (std::size_t i = 0; i + 2 < positions_m.size(); i += 3) {
    if (i > 0) text += ", ";
    text += '(';
    append_float(text, positions_m[i]);
    text += ", ";
    append_float(text, positions_m[i + 1]);
    text += ", ";
    append_float(text, positions_m[i + 2]);
    text += ')';
  }
  return text + "]";
}

/// The samples of one mesh stand together in the file, but come with those of the others: each waits in a file of its
/// own.
class UsdaExporter final : public Exporter {
 public:
  explicit UsdaExporter(const ExportPlan& plan) : plan_(plan) {}

  base::Status add(const Sample& sample) override {
    if (sample.index == 0) {
      first_ = sample.bodies;
      points_.resize(first_.size());
    } else if (base::Status same = check_same_bodies(first_, sample); !same.ok()) {
      return same;
    }
    for (std::size_t body = 0; body < points_.size(); ++body) {
      const std::string line =
          "            " + std::to_string(sample.index) + ": " + points_text(sample.bodies[body].positions_m) + ",\n";
      if (base::Status written = points_[body].append(line); !written.ok()) return written;
    }
    return {};
  }

  base::Status finish() override {
    out_.open(plan_.out);
    if (!out_) return write_failure(plan_.out);
    write_head();
    const std::vector<std::string> names = file_names(first_, "");
    for (std::size_t body = 0; body < first_.size(); ++body) {
      write_mesh(names[body], first_[body]);
      out_ << "        point3f[] points.timeSamples = {\n";
      if (base::Status copied = points_[body].copy_to(out_); !copied.ok()) return copied;
      out_ << "        }\n    }\n";
    }
    out_ << "}\n";
    out_.close();
    return out_ ? base::Status() : write_failure(plan_.out);
  }

 private:
  void write_head() {
    std::string rate;
    append_float(rate, plan_.rate_hz);
    out_ << "#usda 1.0\n(\n    defaultPrim = \"World\"\n    upAxis = \"Y\"\n    metersPerUnit = 1\n"
         << "    timeCodesPerSecond = " << rate << "\n    framesPerSecond = " << rate << "\n    startTimeCode = 0\n"
         << "    endTimeCode = " << plan_.samples - 1 << "\n)\n\ndef Xform \"World\"\n{\n";
  }

  /// Up to its points.
  void write_mesh(const std::string& name, const SoftBodyFrame& body) {
    const auto& indices = body.topology->indices;
    out_ << "    def Mesh \"" << name << "\"\n    {\n"
         << "        custom string pneuma:name = " << json_string(body.name) << "\n"
         << "        uniform token subdivisionScheme = \"none\"\n        int[] faceVertexCounts = [";
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) out_ << (i > 0 ? ", 3" : "3");
    out_ << "]\n        int[] faceVertexIndices = [";
    for (std::size_t i = 0; i < indices.size(); ++i) out_ << (i > 0 ? ", " : "") << indices[i];
    out_ << "]\n";
  }

  ExportPlan plan_;
  std::ofstream out_;
  std::vector<SoftBodyFrame> first_;
  std::vector<ScratchFile> points_;
};

}  // namespace

base::Result<std::unique_ptr<Exporter>> export_usda(const ExportPlan& plan) {
  return std::unique_ptr<Exporter>(std::make_unique<UsdaExporter>(plan));
}

}  // namespace pneuma::client
