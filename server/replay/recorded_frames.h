// A recording's frame as the server's streams take it.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "app/frame_source.h"
#include "pneuma_client/frames.h"

namespace pneuma::replay {

class RecordedFrames final : public app::FrameSource {
 public:
  explicit RecordedFrames(double tick_period_s) : tick_period_s_(tick_period_s) {}

  /// Takes the frame to show. True where its bodies, solids or joints are not those of the frame before.
  bool show(client::DecodedFrame frame);
  [[nodiscard]] const client::DecodedFrame& frame() const { return frame_; }

  [[nodiscard]] double time_s() const override { return frame_.time_s; }
  [[nodiscard]] double tick_period_s() const override { return tick_period_s_; }
  [[nodiscard]] std::size_t soft_body_count() const override { return frame_.bodies.size(); }
  [[nodiscard]] const std::string& soft_body_name(std::size_t index) const override {
    return frame_.bodies[index].name;
  }
  [[nodiscard]] std::shared_ptr<const physics::Mesh> mesh(std::size_t index) const override;
  void copy_positions(std::size_t index, std::span<double> out_m) const override;
  [[nodiscard]] const std::vector<std::uint32_t>& kept_vertices(std::size_t index) const override;
  [[nodiscard]] bool has_velocities() const override { return frame_.has_velocities; }
  void copy_velocities(std::size_t index, std::span<double> out_m_s) const override;
  [[nodiscard]] bool has_scalars() const override { return frame_.has_scalars; }
  [[nodiscard]] app::BodyScalars scalars(std::size_t index) const override;
  [[nodiscard]] bool has_contacts() const override { return false; }
  [[nodiscard]] std::vector<app::TouchedVertex> contacts(std::size_t) const override { return {}; }
  void describe_solids(v1::Layout& layout) const override;
  [[nodiscard]] std::vector<physics::Pose> poses() const override;
  void describe_joints(v1::Layout& layout) const override;

 private:
  double tick_period_s_;
  client::DecodedFrame frame_;
  std::map<std::string, std::shared_ptr<const physics::Mesh>> meshes_;  // by the hash of their topology, as first shown
};

}  // namespace pneuma::replay
