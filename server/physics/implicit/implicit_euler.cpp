#include "physics/implicit/implicit_euler.h"

namespace pneuma::physics {

template <class Real>
bool implicit_euler(SoftState<Real>& body, ImplicitTables<Real>& tables, const StageAccuracy& accuracy,
                    const Surroundings& surroundings, double dt_s, ImplicitSolver<Real>& solver, Profile* profile) {
  std::vector<Vec3d> x(body.x.size());
  std::vector<Vec3d> v(body.x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = body.x[i].template cast<double>();
    v[i] = body.v[i].template cast<double>();
  }
  std::vector<Vec3d> u = v;
  if (!solver.solve(body, tables, {x, v, dt_s}, accuracy, surroundings, u, profile)) return false;
  for (std::size_t i = 0; i < u.size(); ++i) {
    body.v[i] = u[i].cast<Real>();
    body.dr[i] = (dt_s * u[i]).template cast<Real>();
  }
  return true;
}

template bool implicit_euler<float>(SoftState<float>&, ImplicitTables<float>&, const StageAccuracy&,
                                    const Surroundings&, double, ImplicitSolver<float>&, Profile*);
template bool implicit_euler<double>(SoftState<double>&, ImplicitTables<double>&, const StageAccuracy&,
                                     const Surroundings&, double, ImplicitSolver<double>&, Profile*);

}  // namespace pneuma::physics
