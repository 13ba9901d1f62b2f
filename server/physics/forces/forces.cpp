#include "physics/forces/forces.h"

#include <algorithm>
#include <cmath>

#include "physics/forces/gas.h"
#include "physics/forces/sampled_volume.h"
#include "physics/state/bounds.h"

namespace pneuma::physics {

namespace {

// V = 1/6 sum of a.(b x c), measured from a vertex of the body itself so that a body far from the origin loses no
// digits.
template <class Real>
double exact_volume_m3(const Mesh& mesh, std::span<const Vec3<Real>> x) {
  const Vec3<Real> origin = x[0];
  double six_volumes = 0.0;
  for (const Face& face : mesh.faces) {
    const Vec3<Real> a = x[face[0]] - origin;
    const Vec3<Real> b = x[face[1]] - origin;
    const Vec3<Real> c = x[face[2]] - origin;
    six_volumes += static_cast<double>(a.dot(b.cross(c)));
  }
  return six_volumes / 6.0;
}

// Of a body too thin for its samples, in too many layers, or turned inside out, sampling finds nothing, or less: which
// it is, and how hard its gas is to press, only the exact volume tells.
template <class Real>
double found_or_exact(double sampled_m3, const SoftBody& body, std::span<const Vec3<Real>> x) {
  return sampled_m3 > 0.0 ? sampled_m3 : exact_volume_m3<Real>(*body.mesh, x);
}

template <class Real>
void add_pressure_on_faces(const Mesh& mesh, double pressure_pa, std::span<const Vec3<Real>> x,
                           std::span<Vec3<Real>> force) {
  const auto sixth =
      static_cast<Real>(pressure_pa / 6.0);  // half the cross product is the area, a third goes to each particle
  for (const Face& face : mesh.faces) {
    const Vec3<Real> share = sixth * (x[face[1]] - x[face[0]]).cross(x[face[2]] - x[face[0]]);
    force[face[0]] += share;
    force[face[1]] += share;
    force[face[2]] += share;
  }
}

// Footnote 3: a particle is pushed along its own normal, the mean of its faces' normals (their sum divided by their
// number). We read the size of the push as a third of the area around it, which keeps it near the spread by faces.
template <class Real>
void add_pressure_on_normals(const Mesh& mesh, double pressure_pa, std::span<const Vec3<Real>> x,
                             NormalSpread<Real>& spread, std::span<Vec3<Real>> force) {
  spread.normal_sums.assign(x.size(), Vec3<Real>::Zero());
  spread.areas_m2.assign(x.size(), Real{0});
  for (const Face& face : mesh.faces) {
    const Vec3<Real> cross = (x[face[1]] - x[face[0]]).cross(x[face[2]] - x[face[0]]);
    const Real twice_area = cross.norm();
    if (!(twice_area > 0)) continue;
    for (const std::uint32_t vertex : face) {
      spread.normal_sums[vertex] += cross / twice_area;
      spread.areas_m2[vertex] += twice_area / 6;
    }
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Real faces = static_cast<Real>(mesh.face_counts[i]);
    force[i] += static_cast<Real>(pressure_pa) * spread.areas_m2[i] * (spread.normal_sums[i] / faces);
  }
}

// What is left of the grabs of one vertex: an explicit step of a spring much stiffer than m/dt^2 would throw the
// particle about, so they hold no harder than that together, each in its proportion.
struct GrabShares {
  double stiffness = 1.0;
  double damping = 1.0;
};

GrabShares shares_of(std::span<const Grab> grabs, double mass_kg, double dt_s) {
  double stiffness_n_m = 0.0;
  double damping_n_s_m = 0.0;
  for (const Grab& grab : grabs) {
    stiffness_n_m += grab.stiffness_n_m;
    damping_n_s_m += grab.damping_n_s_m;
  }
  const double stiffness_max = 0.25 * mass_kg / (dt_s * dt_s);
  const double damping_max = 0.5 * mass_kg / dt_s;
  return {stiffness_n_m > stiffness_max ? stiffness_max / stiffness_n_m : 1.0,
          damping_n_s_m > damping_max ? damping_max / damping_n_s_m : 1.0};
}

template <class Real>
void add_grabs(const SoftState<Real>& body, std::span<const Vec3<Real>> x, std::span<const Vec3<Real>> v, double dt_s,
               std::span<Vec3<Real>> force) {
  for (auto first = body.grabs.begin(); first != body.grabs.end();) {
    const std::uint32_t vertex = first->vertex;
    const auto last = std::find_if(first, body.grabs.end(), [&](const Grab& grab) { return grab.vertex != vertex; });
    const GrabShares shares = shares_of({first, last}, body.mass_kg(vertex), dt_s);
    for (; first != last; ++first) {
      const Vec3d offset = first->target - body.origin_m - x[vertex].template cast<double>();
      const Vec3d pull = shares.stiffness * first->stiffness_n_m * offset -
                         shares.damping * first->damping_n_s_m * v[vertex].template cast<double>();
      force[vertex] += pull.cast<Real>();
    }
  }
}

}  // namespace

bool has_wind(const SoftBody& body, const Atmosphere& atmosphere) {
  return (body.drag.normal > 0.0 || body.drag.tangential > 0.0) && atmosphere.density_kg_m3 > 0.0;
}

// A flat plate in an air stream: 1/2 rho C A u|u|, split into the part along the face's normal and the part along the
// face.
template <class Real>
void add_wind(const SoftBody& body, const Atmosphere& atmosphere, std::span<const Vec3<Real>> x,
              std::span<const Vec3<Real>> v, std::span<Vec3<Real>> force) {
  const auto half_density = static_cast<Real>(0.5 * atmosphere.density_kg_m3);
  const auto drag_normal = static_cast<Real>(body.drag.normal);
  const auto drag_tangential = static_cast<Real>(body.drag.tangential);
  const Vec3<Real> wind = atmosphere.wind.cast<Real>();
  for (const Face& face : body.mesh->faces) {
    const auto [a, b, c] = face;
    const Vec3<Real> cross = (x[b] - x[a]).cross(x[c] - x[a]);
    const Real twice_area = cross.norm();
    if (!(twice_area > 0)) continue;
    const Vec3<Real> normal = cross / twice_area;
    const Vec3<Real> stream = wind - (v[a] + v[b] + v[c]) / Real{3};
    const Real through = stream.dot(normal);
    const Vec3<Real> along = stream - through * normal;
    const Vec3<Real> share =
        (half_density * twice_area / Real{6}) *
        (drag_normal * std::abs(through) * through * normal + drag_tangential * along.norm() * along);
    force[a] += share;
    force[b] += share;
    force[c] += share;
  }
}

template <class Real>
double body_volume_m3(const SoftBody& body, std::span<const Vec3<Real>> x) {
  switch (body.volume.method) {
    case VolumeMethod::exact:
      return exact_volume_m3<Real>(*body.mesh, x);
    case VolumeMethod::box:
      return static_cast<double>(volume_m3(fit_aabb<Real>(x)));
    case VolumeMethod::ball:
      return static_cast<double>(volume_m3(fit_ball<Real>(x)));
    case VolumeMethod::ellipsoid:
      return static_cast<double>(volume_m3(fit_ellipsoid<Real>(x)));
    case VolumeMethod::subdivided:
      return found_or_exact<Real>(subdivided_volume_m3<Real>(x, body.mesh->faces, body.volume.resolution), body, x);
    case VolumeMethod::monte_carlo:
      return found_or_exact<Real>(monte_carlo_volume_m3<Real>(x, body.mesh->faces, body.volume.resolution), body, x);
  }
  return 0.0;
}

template <class Real>
void add_pressure(SoftState<Real>& body, double pressure_pa, std::span<const Vec3<Real>> x,
                  std::span<Vec3<Real>> force) {
  if (body.body.pressure_spread == PressureSpread::faces) {
    add_pressure_on_faces<Real>(*body.body.mesh, pressure_pa, x, force);
  } else {
    add_pressure_on_normals<Real>(*body.body.mesh, pressure_pa, x, body.spread, force);
  }
}

template <class Real>
void add_other_forces(SoftState<Real>& body, std::span<const Vec3<Real>> x, std::span<const Vec3<Real>> v,
                      const Surroundings& surroundings, double dt_s, bool with_gas, std::span<Vec3<Real>> force,
                      Profile* profile) {
  if (!body.hinges.empty()) {
    const StageTimer timer(profile, Stage::bending);
    add_bending<Real>(body.hinges, body.body.springs.bend_stiffness_n_m, x, force);
  }
  if (body.gas && with_gas) {
    {  // 2: volume
      const StageTimer timer(profile, Stage::volume);
      body.volume_m3 = body_volume_m3<Real>(body.body, x);
    }
    // 3: pressure
    const StageTimer timer(profile, Stage::pressure);
    update_pressure(body, surroundings.atmosphere.pressure_pa);
    add_pressure<Real>(body, body.pressure_pa, x, force);
  }
  if (has_wind(body.body, surroundings.atmosphere)) {
    const StageTimer timer(profile, Stage::wind);
    add_wind<Real>(body.body, surroundings.atmosphere, x, v, force);
  }
  if (!body.grabs.empty()) {
    const StageTimer timer(profile, Stage::grabs);
    add_grabs<Real>(body, x, v, dt_s, force);
  }
}

#define PNEUMA_INSTANTIATE(Real)                                                                                   \
  template double body_volume_m3<Real>(const SoftBody&, std::span<const Vec3<Real>>);                              \
  template void add_wind<Real>(const SoftBody&, const Atmosphere&, std::span<const Vec3<Real>>,                    \
                               std::span<const Vec3<Real>>, std::span<Vec3<Real>>);                                \
  template void add_pressure<Real>(SoftState<Real>&, double, std::span<const Vec3<Real>>, std::span<Vec3<Real>>);  \
  template void add_other_forces<Real>(SoftState<Real>&, std::span<const Vec3<Real>>, std::span<const Vec3<Real>>, \
                                       const Surroundings&, double, bool, std::span<Vec3<Real>>, Profile*);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
