// Subcommands that push and hold bodies.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "command/arguments.h"
#include "command/checks.h"
#include "command/subcommands.h"

namespace pneuma::client {

namespace {

v1::Vec3 vector_of(const std::string& text) {
  const auto numbers = parse_numbers<3>(text).value();
  return to_vec3(numbers[0], numbers[1], numbers[2]);
}

struct ImpulseArguments {
  v1::Impulse request;
  std::uint32_t vertex = 0;
  std::string at;
  std::string ray;
  std::string impulse;
  double radius_m = 0.0;
};

struct GrabFlags {
  std::uint32_t vertex = 0;
  std::string at;
  std::vector<std::string> to;
};

base::Status send_impulse(Session& session, ImpulseArguments arguments) {
  v1::Impulse& request = arguments.request;
  *request.mutable_impulse() = vector_of(arguments.impulse);
  if (!arguments.at.empty()) {
    *request.mutable_near()->mutable_position() = vector_of(arguments.at);
    request.mutable_near()->set_radius_m(arguments.radius_m);
  } else if (!arguments.ray.empty()) {
    const auto ray = parse_numbers<6>(arguments.ray).value();
    *request.mutable_ray()->mutable_origin() = to_vec3(ray[0], ray[1], ray[2]);
    *request.mutable_ray()->mutable_direction() = to_vec3(ray[3], ray[4], ray[5]);
    request.mutable_ray()->set_radius_m(arguments.radius_m);
  }
  return report(session, "hit", session.client.impulse(request));
}

}  // namespace

void add_impulse(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("impulse", "Hit a body: at a vertex, at a point, along a ray, or as a whole");
  auto arguments = std::make_shared<ImpulseArguments>();
  command
      ->add_option_function<std::string>("WORLD",
                                         [arguments](const std::string& name) { arguments->request.set_world(name); })
      ->required();
  auto* body = command->add_option_function<std::string>(
      "BODY", [arguments](const std::string& name) { arguments->request.set_body(name); },
      "A soft or rigid body; with --ray, the first one hit where none is named");
  auto* vertex = command->add_option("--vertex", arguments->vertex, "The vertex of this index");
  auto* at = command->add_option("--at", arguments->at, "X,Y,Z: the surface near this point, in metres");
  auto* ray = command->add_option("--ray", arguments->ray, "OX,OY,OZ,DX,DY,DZ: where a ray first meets a surface");
  auto* radius = command->add_option("--radius", arguments->radius_m, "Share it with the vertices within, in metres");
  command->add_option("--impulse", arguments->impulse, "X,Y,Z in newton seconds")
      ->required()
      ->check(numbers_check<3>());
  at->check(numbers_check<3>())->excludes(vertex);
  ray->check(numbers_check<6>())->excludes(vertex)->excludes(at);
  radius->check(not_negative_check())->excludes(vertex);
  command->callback([&task, arguments, body, vertex, at, ray, radius] {
    if (body->empty() && ray->empty()) throw CLI::RequiredError("BODY");
    if (!radius->empty() && at->empty() && ray->empty()) throw CLI::RequiresError("--radius", "--at or --ray");
    if (!vertex->empty()) arguments->request.set_vertex(arguments->vertex);
    task.with_server = [arguments](Session& session) { return send_impulse(session, *arguments); };
  });
}

void add_grab(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("grab", "Take hold of a vertex, move it along straight lines, and let go");
  auto arguments = std::make_shared<GrabArguments>();
  auto flags = std::make_shared<GrabFlags>();
  command->add_option("WORLD", *arguments->request.mutable_world())->required();
  command->add_option("BODY", *arguments->request.mutable_body(), "A soft body")->required();
  auto* vertex = command->add_option("--vertex", flags->vertex, "The vertex of this index");
  auto* at = command->add_option("--at", flags->at, "X,Y,Z: the vertex nearest to this point, in metres");
  command->add_option("--to", flags->to, "X,Y,Z: move it there, in metres; may be given for several points")
      ->required()
      ->allow_extra_args(false)
      ->check(numbers_check<3>());
  command->add_option("--seconds", arguments->seconds, "Time for the whole way")
      ->check(seconds_check())
      ->capture_default_str();
  command->add_option("--hold", arguments->hold_s, "Hold it at the end for so many seconds")->check(seconds_check());
  command
      ->add_option_function<double>(
          "--stiffness", [arguments](double n_m) { arguments->request.set_stiffness_n_m(n_m); },
          "Of the spring that holds it, in N/m; otherwise that of the body's springs")
      ->check(positive_check());
  command
      ->add_option_function<double>(
          "--damping", [arguments](double n_s_m) { arguments->request.set_damping_n_s_m(n_s_m); },
          "Of the spring, in N s/m; otherwise critical")
      ->check(positive_check());
  command
      ->add_option_function<double>(
          "--radius", [arguments](double m) { arguments->request.set_radius_m(m); },
          "Hold the skin around it too, this far along it, in metres: the further off, the less")
      ->check(positive_check());
  at->check(numbers_check<3>())->excludes(vertex);
  command->callback([&task, arguments, flags, vertex, at] {
    if (vertex->empty() && at->empty()) throw CLI::RequiredError("--vertex or --at");
    if (!vertex->empty()) arguments->request.set_vertex(flags->vertex);
    if (!at->empty()) *arguments->request.mutable_near()->mutable_position() = vector_of(flags->at);
    for (const std::string& point : flags->to) arguments->to.push_back(vector_of(point));
    task.with_server = [arguments](Session& session) { return grab(session, *arguments); };
  });
}

}  // namespace pneuma::client
