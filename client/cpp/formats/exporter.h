// Recordings in the file formats of others. Lengths are in metres, y is up, as in the world.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "formats/sampler.h"

namespace pneuma::client {

struct ExportPlan {
  std::string out;  // a folder or a file, as the format has it
  double rate_hz = 0.0;
  std::size_t samples = 0;
};

/// Takes samples one by one, and holds no more than one of them in memory.
class Exporter {
 public:
  virtual ~Exporter() = default;
  [[nodiscard]] virtual base::Status add(const Sample& sample) = 0;
  /// After the last sample: the files are whole.
  [[nodiscard]] virtual base::Status finish() = 0;
};

/// A folder of Wavefront files, one a sample, an object a body: frame-000000.obj and so on.
[[nodiscard]] base::Result<std::unique_ptr<Exporter>> export_obj(const ExportPlan& plan);
/// A folder with a point cache (version 2 of 3ds Max's) and a Wavefront file of its mesh for each body. The format
/// knows no frame rate: a sample is a frame.
[[nodiscard]] base::Result<std::unique_ptr<Exporter>> export_pc2(const ExportPlan& plan);
/// One file in USD's text form: a mesh a body, with its points as time samples.
[[nodiscard]] base::Result<std::unique_ptr<Exporter>> export_usda(const ExportPlan& plan);
/// One binary glTF 2.0 file: a mesh a body, a morph target a sample after the first, and an animation of their weights.
[[nodiscard]] base::Result<std::unique_ptr<Exporter>> export_gltf(const ExportPlan& plan);
/// Samples that a glTF file holds: programs take a thousand morph targets, and their memory goes with the square.
inline constexpr std::size_t gltf_samples_max = 1'000;

/// Writes the bodies as a Wavefront file, an object each.
[[nodiscard]] base::Status write_obj(const std::vector<SoftBodyFrame>& bodies, const std::string& path);

// What the formats share:

/// An error where the sample's bodies are not those that the files began with.
[[nodiscard]] base::Status check_same_bodies(const std::vector<SoftBodyFrame>& first, const Sample& sample);
/// Names that differ from each other, of letters, digits and '_' (and of `others`), not first a digit.
[[nodiscard]] std::vector<std::string> file_names(const std::vector<SoftBodyFrame>& bodies, std::string_view others);
/// What the system said of a file that could not be written.
[[nodiscard]] base::Status write_failure(const std::string& path);
[[nodiscard]] base::Status make_folder(const std::string& path);

}  // namespace pneuma::client
