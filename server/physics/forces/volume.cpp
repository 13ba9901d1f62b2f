#include "physics/forces/volume.h"

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

}  // namespace

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

template double body_volume_m3<float>(const SoftBody&, std::span<const Vec3<float>>);
template double body_volume_m3<double>(const SoftBody&, std::span<const Vec3<double>>);

}  // namespace pneuma::physics
