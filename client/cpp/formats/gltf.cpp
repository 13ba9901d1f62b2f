// Binary glTF 2.0 (Khronos, ISO/IEC 12113:2022): a 12-byte header, a chunk of JSON, a chunk of numbers. A body is a
// mesh whose POSITION is that of the first sample; each later sample is a morph target of displacements from there; the
// weights go linearly from one target to the next, which moves each vertex on a straight line between samples.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <span>

#include "base/byte_order.h"
#include "base/version.h"
#include "command/json.h"
#include "formats/exporter.h"
#include "formats/scratch_file.h"

namespace pneuma::client {

namespace {

// Of the specification.
constexpr std::uint64_t type_float = 5126;
constexpr std::uint64_t type_uint32 = 5125;
constexpr std::uint64_t target_vertices = 34962;
constexpr std::uint64_t target_indices = 34963;
constexpr std::uint32_t magic = 0x46546C67;       // "glTF"
constexpr std::uint32_t chunk_json = 0x4E4F534A;  // "JSON"
constexpr std::uint32_t chunk_bin = 0x004E4942;   // "BIN\0"

std::string raw_array(std::span<const std::string> items) {
  std::string text = "[";
  for (const std::string& item : items) text.append(text.size() > 1 ? "," : "").append(item);
  return text + "]";
}

class GltfExporter final : public Exporter {
 public:
  explicit GltfExporter(const ExportPlan& plan) : plan_(plan) {}

  base::Status add(const Sample& sample) override;
  base::Status finish() override;

 private:
  struct Body {
    std::size_t positions = 0;         // accessor of the first sample
    std::size_t indices = 0;           // accessor
    std::vector<std::size_t> targets;  // accessors
    std::vector<float> first_m;
  };

  base::Status append(const std::string& bytes);
  /// A view of what is appended next.
  std::size_t add_view(std::size_t bytes, std::uint64_t target);
  std::size_t add_accessor(const JsonObject& accessor);
  base::Result<std::size_t> add_positions(const std::vector<float>& coordinates_m);
  base::Status begin(const Sample& sample);
  base::Status add_weights();
  [[nodiscard]] std::string json() const;
  [[nodiscard]] JsonObject mesh_json(std::size_t body) const;
  [[nodiscard]] JsonObject animation_json() const;

  ExportPlan plan_;
  std::vector<SoftBodyFrame> first_;
  std::vector<Body> bodies_;
  ScratchFile numbers_;
  std::uint64_t bytes_ = 0;  // of them
  std::vector<std::string> views_;
  std::vector<std::string> accessors_;
  std::size_t times_ = 0;    // accessor
  std::size_t weights_ = 0;  // accessor
};

base::Status GltfExporter::append(const std::string& bytes) {
  bytes_ += bytes.size();
  // Its header counts the file's bytes in 32 bits; what else is in it is far less than half.
  if (bytes_ > std::numeric_limits<std::uint32_t>::max() / 2) {
    return {base::StatusCode::limit_exceeded, "would be more than 2 GiB; give a lower --rate, or one --body",
            plan_.out};
  }
  return numbers_.append(bytes);
}

std::size_t GltfExporter::add_view(std::size_t bytes, std::uint64_t target) {
  JsonObject view;
  view.add("buffer", std::uint64_t{0}).add("byteOffset", bytes_).add("byteLength", std::uint64_t{bytes});
  if (target != 0) view.add("target", target);
  views_.push_back(view.text());
  return views_.size() - 1;
}

std::size_t GltfExporter::add_accessor(const JsonObject& accessor) {
  accessors_.push_back(accessor.text());
  return accessors_.size() - 1;
}

base::Result<std::size_t> GltfExporter::add_positions(const std::vector<float>& coordinates_m) {
  std::array<double, 3> least{};
  std::array<double, 3> most{};
  least.fill(std::numeric_limits<double>::infinity());
  most.fill(-std::numeric_limits<double>::infinity());
  std::string bytes;
  for (std::size_t i = 0; i < coordinates_m.size(); ++i) {
    least[i % 3] = std::min(least[i % 3], static_cast<double>(coordinates_m[i]));
    most[i % 3] = std::max(most[i % 3], static_cast<double>(coordinates_m[i]));
    base::append_number(bytes, coordinates_m[i]);
  }
  JsonObject accessor;
  accessor.add("bufferView", std::uint64_t{add_view(bytes.size(), target_vertices)})
      .add("componentType", type_float)
      .add("count", std::uint64_t{coordinates_m.size() / 3})
      .add("type", "VEC3")
      .add("min", least)
      .add("max", most);
  if (base::Status appended = append(bytes); !appended.ok()) return appended;
  return add_accessor(accessor);
}

base::Status GltfExporter::begin(const Sample& sample) {
  first_ = sample.bodies;
  for (const SoftBodyFrame& frame : first_) {
    Body& body = bodies_.emplace_back();
    body.first_m.assign(frame.positions_m.begin(), frame.positions_m.end());
    const auto positions = add_positions(body.first_m);
    if (!positions.ok()) return positions.status();
    body.positions = *positions;
    const auto& indices = frame.topology->indices;
    std::string bytes;
    for (const std::uint32_t index : indices) base::append_number(bytes, index);
    body.indices = add_accessor(JsonObject()
                                    .add("bufferView", std::uint64_t{add_view(bytes.size(), target_indices)})
                                    .add("componentType", type_uint32)
                                    .add("count", std::uint64_t{indices.size()})
                                    .add("type", "SCALAR"));
    if (base::Status appended = append(bytes); !appended.ok()) return appended;
  }
  return {};
}

base::Status GltfExporter::add(const Sample& sample) {
  if (sample.index == 0) return begin(sample);
  if (base::Status same = check_same_bodies(first_, sample); !same.ok()) return same;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    const std::vector<double>& positions_m = sample.bodies[i].positions_m;
    std::vector<float> moved_m(positions_m.size());
    for (std::size_t c = 0; c < moved_m.size(); ++c) {
      moved_m[c] = static_cast<float>(positions_m[c] - static_cast<double>(body.first_m[c]));
    }
    const auto target = add_positions(moved_m);
    if (!target.ok()) return target.status();
    body.targets.push_back(*target);
  }
  return {};
}

/// The times of the samples, and at each of them the weights of all targets: 1 for its own. What is not named is 0.
base::Status GltfExporter::add_weights() {
  const std::size_t targets = bodies_.front().targets.size();
  std::string times;
  std::string places;
  std::string ones;
  for (std::size_t sample = 0; sample <= targets; ++sample) {
    base::append_number(times, static_cast<float>(static_cast<double>(sample) / plan_.rate_hz));
    if (sample == 0) continue;
    base::append_number(places, static_cast<std::uint32_t>(sample * targets + sample - 1));
    base::append_number(ones, 1.0F);
  }
  const double end_s = static_cast<float>(static_cast<double>(targets) / plan_.rate_hz);
  times_ = add_accessor(JsonObject()
                            .add("bufferView", std::uint64_t{add_view(times.size(), 0)})
                            .add("componentType", type_float)
                            .add("count", std::uint64_t{targets + 1})
                            .add("type", "SCALAR")
                            .add("min", std::array{0.0})
                            .add("max", std::array{end_s}));
  if (base::Status appended = append(times); !appended.ok()) return appended;
  JsonObject indices;
  indices.add("bufferView", std::uint64_t{add_view(places.size(), 0)}).add("componentType", type_uint32);
  if (base::Status appended = append(places); !appended.ok()) return appended;
  JsonObject values;
  values.add("bufferView", std::uint64_t{add_view(ones.size(), 0)});
  if (base::Status appended = append(ones); !appended.ok()) return appended;
  weights_ = add_accessor(
      JsonObject()
          .add("componentType", type_float)
          .add("count", std::uint64_t{(targets + 1) * targets})
          .add("type", "SCALAR")
          .add("sparse",
               JsonObject().add("count", std::uint64_t{targets}).add("indices", indices).add("values", values)));
  return {};
}

JsonObject GltfExporter::mesh_json(std::size_t body) const {
  const Body& its = bodies_[body];
  JsonObject primitive;
  primitive.add("attributes", JsonObject().add("POSITION", std::uint64_t{its.positions}))
      .add("indices", std::uint64_t{its.indices});
  JsonObject mesh;
  mesh.add("name", first_[body].name);
  if (!its.targets.empty()) {
    std::vector<JsonObject> targets;
    for (const std::size_t target : its.targets) targets.emplace_back().add("POSITION", std::uint64_t{target});
    primitive.add("targets", std::span<const JsonObject>(targets));
  }
  mesh.add("primitives", std::span<const JsonObject>(&primitive, 1));
  return mesh;
}

JsonObject GltfExporter::animation_json() const {
  JsonObject sampler;
  sampler.add("input", std::uint64_t{times_}).add("output", std::uint64_t{weights_}).add("interpolation", "LINEAR");
  std::vector<JsonObject> channels;
  for (std::size_t body = 0; body < bodies_.size(); ++body) {
    const JsonObject target = JsonObject().add("node", std::uint64_t{body}).add("path", "weights");
    channels.emplace_back().add("sampler", std::uint64_t{0}).add("target", target);
  }
  JsonObject animation;
  animation.add("name", "recording")
      .add("samplers", std::span<const JsonObject>(&sampler, 1))
      .add("channels", std::span<const JsonObject>(channels));
  return animation;
}

std::string GltfExporter::json() const {
  std::vector<JsonObject> nodes;
  std::vector<JsonObject> meshes;
  std::vector<std::string> node_numbers;
  for (std::size_t body = 0; body < bodies_.size(); ++body) {
    nodes.emplace_back().add("name", first_[body].name).add("mesh", std::uint64_t{body});
    meshes.push_back(mesh_json(body));
    node_numbers.push_back(std::to_string(body));
  }
  const JsonObject scene = JsonObject().add_raw("nodes", raw_array(node_numbers));
  const JsonObject buffer = JsonObject().add("byteLength", bytes_);
  JsonObject root;
  root.add("asset", JsonObject().add("version", "2.0").add("generator", "pneuma " + std::string(base::version)))
      .add("scene", std::uint64_t{0})
      .add("scenes", std::span<const JsonObject>(&scene, 1))
      .add("nodes", std::span<const JsonObject>(nodes))
      .add("meshes", std::span<const JsonObject>(meshes))
      .add("buffers", std::span<const JsonObject>(&buffer, 1))
      .add_raw("bufferViews", raw_array(views_))
      .add_raw("accessors", raw_array(accessors_));
  if (!bodies_.front().targets.empty()) {
    const JsonObject animation = animation_json();
    root.add("animations", std::span<const JsonObject>(&animation, 1));
  }
  return root.text();
}

base::Status GltfExporter::finish() {
  if (!bodies_.front().targets.empty()) {
    if (base::Status added = add_weights(); !added.ok()) return added;
  }
  std::string text = json();
  text.resize((text.size() + 3) / 4 * 4, ' ');  // chunks begin at a multiple of 4; the numbers are 4 bytes each
  std::string head;
  base::append_number(head, magic);
  base::append_number(head, std::uint32_t{2});
  base::append_number(head, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + bytes_));
  base::append_number(head, static_cast<std::uint32_t>(text.size()));
  base::append_number(head, chunk_json);
  head += text;
  base::append_number(head, static_cast<std::uint32_t>(bytes_));
  base::append_number(head, chunk_bin);
  std::ofstream out(plan_.out, std::ios::binary);
  if (!out) return write_failure(plan_.out);
  out << head;
  if (base::Status copied = numbers_.copy_to(out); !copied.ok()) return copied;
  out.close();
  return out ? base::Status() : write_failure(plan_.out);
}

}  // namespace

base::Result<std::unique_ptr<Exporter>> export_gltf(const ExportPlan& plan) {
  return std::unique_ptr<Exporter>(std::make_unique<GltfExporter>(plan));
}

}  // namespace pneuma::client
