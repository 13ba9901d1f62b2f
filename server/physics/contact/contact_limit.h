// What contact may give to a body that a long step was solved for. Vertices that are stopped while the rest of a stiff
// body runs on leave it stretched, with energy that nothing paid for: 12 J became 100 kJ. So where contact would leave
// it with more than it had, the body answers the less by vertices and the more as a whole.
#pragma once

#include <span>
#include <vector>

#include "physics/contact/contact_bounds.h"
#include "physics/forces/forces.h"
#include "physics/rigid/contact_surface.h"

namespace pneuma::physics {

/// A vertex that contact stopped.
struct VertexTouch {
  std::uint32_t vertex = 0;
  Vec3d normal = Vec3d::Zero();      // unit, towards the body
  double depth_m = 0.0;              // along it: by how much the move went too far, as seen from what it met
  double gained_m_s = 0.0;           // of the velocity along it: what gravity added after the impact
  Vec3d of_surface = Vec3d::Zero();  // m/s, of what does not give way
  ContactSurface surface;
};

/// What a body met. Its mass is 0 where it does not give way.
struct Partner {
  RigidPart rigid;
  bool parts = false;  // moves that are cut move it too, and keep the common centre of mass
};

/// What contact gave to a body, to be taken from its partner.
struct Exchange {
  Vec3d about = Vec3d::Zero();  // a place near both, so that far from the origin no digits are lost
  Vec3d impulse_n_s = Vec3d::Zero();
  Vec3d moment_n_m_s = Vec3d::Zero();  // of the impulses about that place
  Vec3d shift_kg_m = Vec3d::Zero();    // mass times displacement
};

/// On average, in one contact of a body. A corner of three colliders gives 9 in all their rounds; hundreds of colliders
/// through each other would give thousands, of which a rigid body's answer needs no more.
inline constexpr std::size_t touches_a_vertex_max = 16;

/// Around one contact of one body after the other, of bodies without pins.
template <class Real>
class ContactLimit {
 public:
  /// Before the contacts of one substep.
  void begin_substep(const Surroundings& surroundings, double resting_m_s, double dt_s);

  /// Of a step that was just solved for, without wind or grabs: if it left the body with more than it had, gives it
  /// back the angular momentum that it had, and takes back as much of its change of shape as it needs to.
  void limit_step(SoftState<Real>& body, std::span<const Vec3<Real>> start_m_s);

  /// Takes the body as contact finds it. `start_m_s`: its velocities before the substep; empty if it slept.
  void begin(const SoftState<Real>& body, std::span<const Vec3<Real>> start_m_s);
  /// Leaves out what is past touches_a_vertex_max of all its vertices.
  void note(const VertexTouch& touch) {
    if (touches_.size() < touches_a_vertex_max * v_.size()) touches_.push_back(touch);
  }

  /// Ends a contact that changed v and dr of the noted vertices, or through them of all: leaves as large a share of it
  /// as the limit allows, or nearly so, and the rest to a rigid body that meets the same touches. The limit, the first
  /// time in a substep, is what the body had before it, or what the step gave it if that is more. What passes to the
  /// partner passes from the limit, and what moving surfaces do (`work_j` by vertices) is added to it. Returns what the
  /// body got in all, after rounding.
  Exchange end(SoftState<Real>& body, const Partner& partner, double work_j, EnergyLimit& limit);
  /// What the partner got in the last contact.
  [[nodiscard]] double given_j() const { return given_j_; }

  [[nodiscard]] std::size_t bytes() const;

 private:
  [[nodiscard]] double energy_j(const SoftState<Real>& body, std::span<const Vec3<Real>> v,
                                std::span<const Vec3<Real>> dr);
  [[nodiscard]] double start_energy_j(const SoftState<Real>& body, std::span<const Vec3<Real>> start_m_s);
  [[nodiscard]] Exchange taken(const SoftState<Real>& body, const Vec3d& about) const;

  Surroundings surroundings_;
  double resting_m_s_ = 0.0;
  double dt_s_ = 0.0;
  std::span<const Vec3<Real>> start_m_s_;  // of the body under way
  std::vector<VertexTouch> touches_;
  std::vector<Vec3d> places_;                           // of the touches, where the substep began
  std::vector<Vec3<Real>> v_, dr_;                      // before contact
  std::vector<Vec3<Real>> by_vertex_v_, by_vertex_dr_;  // after it, vertex by vertex
  std::vector<Vec3d> x_;                                // where the move ends
  double given_j_ = 0.0;
};

}  // namespace pneuma::physics
