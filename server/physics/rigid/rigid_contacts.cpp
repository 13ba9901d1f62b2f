#include "physics/rigid/rigid_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "physics/rigid/rigid_box_box.h"
#include "physics/rigid/rigid_mesh.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/rigid/rigid_polyhedron.h"
#include "physics/rigid/sweep.h"
#include "physics/scene/shape_parts.h"

namespace pneuma::physics {
namespace {

// Steps to the deepest point of a body in a round solid: each halves, so the last is a thousandth of the body.
constexpr int descent_steps_max = 10;

struct Solid {
  const Shape& shape;
  const Surface& surface;
  Frame frame;
  Vec3d velocity;
  Vec3d angular_velocity;
  const MeshTree* tree = nullptr;  // of a mesh
};

Solid solid_of(const RigidState& body) {
  return {body.body.shape, body.body.surface, Frame(body.position, body.orientation), body.velocity,
          body.angular_velocity};
}

Solid solid_of(const ColliderState& state) {
  const Collider& c = state.collider;
  return {c.shape,    c.surface,          Frame(state.position, state.orientation),
          c.velocity, c.angular_velocity, state.tree.get()};
}

double half_width_m(const Shape& shape) {
  const auto* convex = std::get_if<ConvexShape>(&shape);
  return convex != nullptr ? convex->solid->half_width_m : half_extents_m(shape).minCoeff();
}

/// Collects the contacts of body `a` with one other solid.
class Collector {
 public:
  Collector(const Solid& a, std::uint32_t index_a, const Solid& b, std::uint32_t index_b, double dt_s,
            std::vector<RigidContact>& contacts)
      : a_(a),
        b_(b),
        index_a_(index_a),
        index_b_(index_b),
        dt_s_(dt_s),
        turn_b_(turned(Quatd::Identity(), b.angular_velocity, dt_s)),
        surface_(combine(a.surface, b.surface)),
        contacts_(contacts) {
    const double radius_m = radius_about_centre(a.shape);
    const double arm_m = (a.frame.origin - b.frame.origin).norm() + radius_m;
    size_m_ = index_b == no_body ? radius_m : std::min(radius_m, radius_about_centre(b.shape));
    thin_m_ = half_width_m(a.shape);
    if (b.tree == nullptr) thin_m_ = std::min(thin_m_, half_width_m(b.shape));
    reach_m_ = rigid_margin_share * size_m_ + surface_.thickness_m +
               dt_s * ((a.velocity - b.velocity).norm() + a.angular_velocity.norm() * radius_m +
                       b.angular_velocity.norm() * arm_m);
    way_m_ = dt_s_ * (a.velocity - velocity_at(b.velocity, b.angular_velocity, a.frame.origin - b.frame.origin));
  }

  void find() {
    if (b_.tree != nullptr) {
      find_on_mesh();
    } else if (const auto* ball = std::get_if<SphereShape>(&a_.shape)) {
      find_of_ball(ball->radius_m);
    } else if (const auto* capsule = std::get_if<CapsuleShape>(&a_.shape)) {
      find_of_capsule(*capsule);
    } else if (const auto* box = std::get_if<BoxShape>(&a_.shape)) {
      find_of_box(box->half_extents_m);
    } else {
      find_of_convex(std::get<ConvexShape>(a_.shape));
    }
  }

 private:
  void add(const Vec3d& point, const Vec3d& normal, double distance_m) {
    if (distance_m > reach_m_) return;
    RigidContact contact;
    contact.a = index_a_;
    contact.b = index_b_;
    contact.point = point;
    contact.normal = normal;
    contact.distance_m = distance_m - surface_.thickness_m;
    contact.size_m = size_m_;
    contact.thin_m = thin_m_;
    contact.surface = surface_;
    if (index_b_ == no_body) {
      const Vec3d arm = point - b_.frame.origin;
      // Along the chord: what friction carries along an arc would leave it by the tangent.
      contact.velocity_b = b_.velocity + (turn_b_ * arm - arm) / dt_s_;
      const bool is_round = std::holds_alternative<SphereShape>(b_.shape);
      contact.bend_m_s2 = is_round ? 0.0 : 0.5 * b_.angular_velocity.squaredNorm() * arm.norm();
    }
    contacts_.push_back(contact);
  }
  void add_local(const SurfacePoint& nearest, double radius_m) {
    add(b_.frame.to_world(nearest.point), b_.frame.rotation * nearest.normal, nearest.distance_m - radius_m);
  }
  /// A room's walls are planes of their own: a point near an edge has two.
  void add_walls(const RoomShape& room, const Vec3d& local, double radius_m) {
    for (int k = 0; k < 3; ++k) {
      for (const double side : {-1.0, 1.0}) {
        SurfacePoint wall{room.half_extents_m[k] - side * local[k], Vec3d::Zero(), local};
        wall.normal[k] = -side;
        wall.point[k] = side * room.half_extents_m[k];
        add_local(wall, radius_m);
      }
    }
  }
  void find_on_mesh() {
    const Eigen::Matrix3d to_mesh = b_.frame.rotation.transpose();
    Frame frame;
    frame.rotation = to_mesh * a_.frame.rotation;
    frame.origin = b_.frame.to_local(a_.frame.origin);
    std::vector<MeshTouch> touches;
    touch_mesh(*b_.tree, {a_.shape, frame, to_mesh * way_m_}, reach_m_, touches);
    for (const MeshTouch& touch : touches) {
      add(b_.frame.to_world(touch.point), b_.frame.rotation * touch.normal, touch.distance_m);
    }
  }
  void find_of_ball(double radius_m) {
    const Vec3d centre = b_.frame.to_local(a_.frame.origin);
    if (const auto* room = std::get_if<RoomShape>(&b_.shape)) {
      add_walls(*room, centre, radius_m);
    } else {
      add_local(nearest_surface(b_.shape, centre), radius_m);
    }
  }
  /// A capsule is the balls along its axis. With a flat solid the two at the ends of what lies over it count, with any
  /// the deepest one.
  void find_of_capsule(const CapsuleShape& capsule) {
    const Vec3d end = capsule.half_height_m * Vec3d::UnitY();
    const Vec3d first = b_.frame.to_local(a_.frame.to_world(-end));
    const Vec3d way = b_.frame.to_local(a_.frame.to_world(end)) - first;
    if (const auto* room = std::get_if<RoomShape>(&b_.shape)) {
      for (const double share : {0.0, 1.0}) add_walls(*room, first + share * way, capsule.radius_m);
      return;
    }
    if (std::holds_alternative<PlaneShape>(b_.shape)) {
      for (const double share : {0.0, 1.0}) {
        add_local(nearest_surface(b_.shape, first + share * way), capsule.radius_m);
      }
      return;
    }
    if (const auto* convex = std::get_if<ConvexShape>(&b_.shape)) {
      std::vector<MeshTouch> touches;
      touch_segment(*convex, first, way, touches);
      for (const MeshTouch& touch : touches) {
        add_local({touch.distance_m, touch.normal, touch.point}, capsule.radius_m);
      }
      return;
    }
    const double deepest = deepest_on_segment(b_.shape, first, way);
    const SurfacePoint nearest = nearest_surface(b_.shape, first + deepest * way);
    add_local(nearest, capsule.radius_m);
    Vec3d reach = Vec3d::Constant(std::numeric_limits<double>::infinity());
    if (const auto* box = std::get_if<BoxShape>(&b_.shape)) {
      Eigen::Index face = 0;
      nearest.normal.cwiseAbs().maxCoeff(&face);
      reach = box->half_extents_m;
      reach[face] = std::numeric_limits<double>::infinity();
    } else if (const auto* other = std::get_if<CapsuleShape>(&b_.shape)) {
      reach.y() = other->half_height_m;
    } else {
      return;
    }
    double low = 0.0;
    double high = 1.0;
    for (Eigen::Index k = 0; k < 3; ++k) {
      if (way[k] == 0.0) {
        if (std::abs(first[k]) > reach[k]) return;
        continue;
      }
      low = std::max(low, (-sign_of(way[k]) * reach[k] - first[k]) / way[k]);
      high = std::min(high, (sign_of(way[k]) * reach[k] - first[k]) / way[k]);
    }
    if (low >= high) return;
    for (const double share : {low, high}) {
      if (share != deepest) add_local(nearest_surface(b_.shape, first + share * way), capsule.radius_m);
    }
  }
  void find_of_box(const Vec3d& half) {
    if (const auto* other = std::get_if<BoxShape>(&b_.shape)) {
      const Manifold manifold = touch_boxes({half, a_.frame}, {other->half_extents_m, b_.frame}, reach_m_);
      for (std::size_t i = 0; i < manifold.count; ++i) {
        add(manifold.points[i].point, manifold.normal, manifold.points[i].distance_m);
      }
      return;
    }
    if (std::holds_alternative<ConvexShape>(b_.shape)) {
      find_between_polyhedra();
      return;
    }
    for (const double x : {-1.0, 1.0}) {
      for (const double y : {-1.0, 1.0}) {
        for (const double z : {-1.0, 1.0}) add_corner(Vec3d(x, y, z).cwiseProduct(half));
      }
    }
    if (!std::holds_alternative<PlaneShape>(b_.shape) && !std::holds_alternative<RoomShape>(b_.shape)) {
      const auto into_box = [&](const Vec3d& p) -> Vec3d { return p.cwiseMax(-half).cwiseMin(half); };
      add_local(deepest_of_body(half.maxCoeff(), into_box), 0.0);
    }
  }
  void find_of_convex(const ConvexShape& convex) {
    if (std::holds_alternative<BoxShape>(b_.shape) || std::holds_alternative<ConvexShape>(b_.shape)) {
      find_between_polyhedra();
    } else if (const auto* ball = std::get_if<SphereShape>(&b_.shape)) {
      find_on_rod(convex, Vec3d::Zero(), ball->radius_m);
    } else if (const auto* capsule = std::get_if<CapsuleShape>(&b_.shape)) {
      find_on_rod(convex, capsule->half_height_m * Vec3d::UnitY(), capsule->radius_m);
    } else {
      for (const Vec3d& corner : convex.solid->corners_m) add_corner(corner);
      if (!std::holds_alternative<EllipsoidShape>(b_.shape)) return;
      const auto into_solid = [&](const Vec3d& p) {
        const PolyhedronPoint nearest = nearest_point(*convex.solid, p);
        return nearest.distance_m > 0.0 ? nearest.position_m : p;
      };
      add_local(deepest_of_body(convex.solid->half_extents_m.maxCoeff(), into_solid), 0.0);
    }
  }
  void find_between_polyhedra() {
    std::vector<MeshTouch> touches;
    touch_polyhedra(polyhedron_pose(a_.shape, a_.frame), polyhedron_pose(b_.shape, b_.frame), reach_m_, touches);
    for (const MeshTouch& touch : touches) add(touch.point, touch.normal, touch.distance_m);
  }
  /// Of a ball or a capsule as b: all that is `radius_m` from the segment of twice `half`.
  void find_on_rod(const ConvexShape& convex, const Vec3d& half, double radius_m) {
    const Vec3d first = a_.frame.to_local(b_.frame.to_world(-half));
    const Vec3d way = a_.frame.to_local(b_.frame.to_world(half)) - first;
    std::vector<MeshTouch> touches;
    touch_segment(convex, first, way, touches);
    for (const MeshTouch& touch : touches) {
      add(a_.frame.to_world(touch.point), -(a_.frame.rotation * touch.normal), touch.distance_m - radius_m);
    }
  }
  void add_corner(const Vec3d& of_body) {
    const Vec3d corner = b_.frame.to_local(a_.frame.to_world(of_body));
    if (const auto* room = std::get_if<RoomShape>(&b_.shape)) {
      add_walls(*room, corner, 0.0);
    } else {
      add_local(nearest_surface(b_.shape, corner), 0.0);
    }
  }
  /// The point of a convex body nearest to, or deepest in, a round solid: the distance to a convex solid is convex, so
  /// walking against its gradient within the body leads there. `into_body` gives a point's nearest in the body.
  template <class IntoBody>
  [[nodiscard]] SurfacePoint deepest_of_body(double longest_half_m, const IntoBody& into_body) const {
    const auto nearest_of = [&](const Vec3d& in_body) {
      return nearest_surface(b_.shape, b_.frame.to_local(a_.frame.to_world(in_body)));
    };
    Vec3d q = into_body(a_.frame.to_local(b_.frame.origin));
    SurfacePoint best = nearest_of(q);
    double step_m = longest_half_m;
    for (int i = 0; i < descent_steps_max; ++i) {
      const Vec3d down = a_.frame.rotation.transpose() * (b_.frame.rotation * best.normal);
      const double length_m = best.distance_m > 0.0 ? best.distance_m : step_m;
      const Vec3d next = into_body(q - length_m * down);
      const SurfacePoint there = nearest_of(next);
      if (there.distance_m < best.distance_m) {
        best = there;
        q = next;
      }
      step_m *= 0.5;
    }
    return best;
  }

  const Solid& a_;
  const Solid& b_;
  std::uint32_t index_a_;
  std::uint32_t index_b_;
  double dt_s_;
  Quatd turn_b_;  // by which b turns meanwhile
  ContactSurface surface_;
  std::vector<RigidContact>& contacts_;
  double size_m_ = 0.0;
  double thin_m_ = 0.0;
  double reach_m_ = 0.0;
  Vec3d way_m_ = Vec3d::Zero();  // of a as seen from b, at its centre
};

}  // namespace

void find_rigid_pairs(std::span<const RigidState> rigid, double dt_s, std::vector<std::uint32_t>& order,
                      std::vector<RigidPair>& pairs) {
  // Each alone may reach this far from its centre, so that two of which neither reaches the other are further apart
  // than the distance at which find_rigid_contacts gives up; twice the margin leaves room for round-off.
  const auto reach_m = [&](std::uint32_t i) {
    const RigidState& body = rigid[i];
    const double size_m = radius_about_centre(body.body.shape);
    return size_m + 2.0 * rigid_margin_share * size_m + body.body.surface.thickness_m +
           dt_s * (body.velocity.norm() + body.angular_velocity.norm() * size_m);
  };
  order.clear();
  pairs.clear();
  for (std::uint32_t i = 0; i < rigid.size(); ++i) {
    if (rigid[i].is_awake() && is_active(rigid[i])) order.push_back(i);
  }
  sort_and_sweep(
      order, [&](std::uint32_t i) { return rigid[i].position.x() - reach_m(i); },
      [&](std::uint32_t i) { return rigid[i].position.x() + reach_m(i); },
      [&](std::uint32_t a, std::uint32_t b) {
        const Vec3d apart_m = (rigid[a].position - rigid[b].position).cwiseAbs();
        if (apart_m.maxCoeff() <= reach_m(a) + reach_m(b)) pairs.push_back({std::min(a, b), std::max(a, b)});
      });
  std::ranges::sort(pairs, [](const RigidPair& p, const RigidPair& q) { return p.a != q.a ? p.a < q.a : p.b < q.b; });
}

double radius_about_centre(const Shape& shape) {
  return of_rigid_shape(shape, 0.0, [](const auto& rigid, const auto& one) { return rigid.radius_m(one); });
}

void find_rigid_contacts(std::span<const RigidState> rigid, std::uint32_t a, std::uint32_t b, double dt_s,
                         std::vector<RigidContact>& contacts) {
  // A ball comes first, before a capsule, before what has corners: the other's surface is looked up from its centre or
  // axis.
  const bool is_ball = std::holds_alternative<SphereShape>(rigid[b].body.shape);
  const bool is_capsule = std::holds_alternative<CapsuleShape>(rigid[b].body.shape);
  const bool has_corners =
      std::holds_alternative<BoxShape>(rigid[a].body.shape) || std::holds_alternative<ConvexShape>(rigid[a].body.shape);
  if (is_ball || (is_capsule && has_corners)) std::swap(a, b);
  const Solid first = solid_of(rigid[a]);
  const Solid second = solid_of(rigid[b]);
  const double apart_m = (first.frame.origin - second.frame.origin).norm();
  const double spin_m_s = first.angular_velocity.norm() * radius_about_centre(first.shape) +
                          second.angular_velocity.norm() * radius_about_centre(second.shape);
  const double size_m = radius_about_centre(first.shape) + radius_about_centre(second.shape);
  const double reach_m = size_m + rigid_margin_share * size_m + first.surface.thickness_m + second.surface.thickness_m +
                         dt_s * ((first.velocity - second.velocity).norm() + spin_m_s);
  if (apart_m <= reach_m) Collector(first, a, second, b, dt_s, contacts).find();
}

void find_collider_contacts(std::span<const RigidState> rigid, std::uint32_t a, const ColliderState& collider,
                            double dt_s, std::vector<RigidContact>& contacts) {
  const Solid first = solid_of(rigid[a]);
  const Solid second = solid_of(collider);
  Collector(first, a, second, no_body, dt_s, contacts).find();
}

}  // namespace pneuma::physics
