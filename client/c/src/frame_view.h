// A frame as C sees it: pointers into what is kept here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pneuma.h"

namespace pneuma::c {

class FrameView {
 public:
  /// Forgets the bodies.
  void begin(const std::string& world, std::uint64_t tick, double time_s);
  /// `velocities_m_s` may be empty. `faces` must outlive what is seen: three indices each.
  void add_soft_body(const std::string& name, std::span<const double> positions_m,
                     std::span<const double> velocities_m_s, std::span<const std::uint32_t> faces);
  void add_solid(const std::string& name, bool is_dynamic, const Eigen::Vector3d& position_m,
                 const Eigen::Quaterniond& orientation);
  /// Valid until begin().
  [[nodiscard]] const pneuma_frame* frame();

 private:
  struct SoftBody {
    std::string name;
    std::vector<float> positions_m;
    std::vector<float> velocities_m_s;
    std::span<const std::uint32_t> faces;
  };
  struct Solid {
    std::string name;
    pneuma_solid seen;
  };

  std::string world_;
  std::vector<SoftBody> soft_bodies_;
  std::vector<Solid> solids_;
  std::vector<pneuma_soft_body> seen_soft_bodies_;
  std::vector<pneuma_solid> seen_solids_;
  pneuma_frame frame_{};
};

}  // namespace pneuma::c
