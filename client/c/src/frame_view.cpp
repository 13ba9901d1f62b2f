#include "frame_view.h"

namespace pneuma::c {

namespace {

std::vector<float> single(std::span<const double> numbers) {
  std::vector<float> rounded;
  rounded.reserve(numbers.size());
  for (const double number : numbers) rounded.push_back(static_cast<float>(number));
  return rounded;
}

}  // namespace

void FrameView::begin(const std::string& world, std::uint64_t tick, double time_s) {
  world_ = world;
  soft_bodies_.clear();
  solids_.clear();
  frame_ = {};
  frame_.tick = tick;
  frame_.time_s = time_s;
}

void FrameView::add_soft_body(const std::string& name, std::span<const double> positions_m,
                              std::span<const double> velocities_m_s, std::span<const std::uint32_t> faces) {
  soft_bodies_.push_back({name, single(positions_m), single(velocities_m_s), faces});
}

void FrameView::add_solid(const std::string& name, bool is_dynamic, const Eigen::Vector3d& position_m,
                          const Eigen::Quaterniond& orientation) {
  solids_.push_back({name,
                     {.name = nullptr,
                      .is_dynamic = is_dynamic ? 1 : 0,
                      .position_m = {position_m.x(), position_m.y(), position_m.z()},
                      .orientation = {orientation.w(), orientation.x(), orientation.y(), orientation.z()}}});
}

// The names and numbers stay where they are from here on.
const pneuma_frame* FrameView::frame() {
  seen_soft_bodies_.clear();
  for (const SoftBody& body : soft_bodies_) {
    seen_soft_bodies_.push_back({.name = body.name.c_str(),
                                 .vertex_count = body.positions_m.size() / 3,
                                 .face_count = body.faces.size() / 3,
                                 .positions_m = body.positions_m.data(),
                                 .velocities_m_s = body.velocities_m_s.empty() ? nullptr : body.velocities_m_s.data(),
                                 .faces = body.faces.data()});
  }
  seen_solids_.clear();
  for (const Solid& solid : solids_) {
    seen_solids_.push_back(solid.seen);
    seen_solids_.back().name = solid.name.c_str();
  }
  frame_.world = world_.c_str();
  frame_.soft_body_count = seen_soft_bodies_.size();
  frame_.soft_bodies = seen_soft_bodies_.data();
  frame_.solid_count = seen_solids_.size();
  frame_.solids = seen_solids_.data();
  return &frame_;
}

}  // namespace pneuma::c
