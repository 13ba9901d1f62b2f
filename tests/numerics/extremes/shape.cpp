// Shapes that a body should never have: squeezed, inside out, degenerate, scrambled.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "numerics/extremes/bullet.h"
#include "numerics/extremes/cases.h"
#include "numerics/extremes/run.h"

namespace pneuma::extremes {

namespace {

using physics::Integrator;
using physics::Scene;

constexpr const char* squeezed_scene = "06-squeezed.json";
constexpr const char* inside_out_scene = "07-inside-out.json";
constexpr const char* degenerate_scene = "11-degenerate-start.json";
constexpr const char* scrambled_scene = "18-scrambled.json";

constexpr double recovered_share = 0.99;

double settling_s(bool quick) {
  return quick ? 10.0 : 60.0;
}

// Where the bodies rest when they begin in their meshes' shapes, by the method that AUTO takes.
std::vector<double> volumes_at_rest_m3(Scene scene) {
  for (physics::SoftBody& body : scene.soft_bodies) body.start_positions_m.clear();
  Run run(with_integrator(std::move(scene), Integrator::automatic));
  run.seconds(10.0);
  std::vector<double> volumes;
  for (std::size_t i = 0; i < run.world().soft_body_count(); ++i) volumes.push_back(run.world().measure(i).volume_m3);
  return volumes;
}

// All bodies are back at the volume of a body at rest.
Result recovers(const char* file, bool quick) {
  const Scene scene = scene_of(file);
  const std::vector<double> at_rest_m3 = volumes_at_rest_m3(scene);
  Survey survey(1.0 - recovered_share);
  survey.add_all(scene, [&](Run& run) {
    run.seconds(settling_s(quick));
    double worst = 0.0;
    for (std::size_t i = 0; i < at_rest_m3.size(); ++i) {
      worst = std::max(worst, std::abs(run.world().measure(i).volume_m3 / at_rest_m3[i] - 1.0));
    }
    return worst;
  });
  return survey.result("volume off by", percent);
}

/// What became of one body by all integrators.
struct Fates {
  int back = 0;
  int runs = 0;
  std::vector<std::string> reported;  // "RK4 (frozen)"
  std::vector<std::string> silent;
};

std::string listed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : ", ").append(word);
  return text;
}

std::string words_of(const Fates& fates) {
  std::string text = std::to_string(fates.back) + " of " + std::to_string(fates.runs) + " recover";
  const bool none = fates.back == 0 && fates.silent.empty();
  if (none) return text + ", all are lost and reported";
  if (!fates.reported.empty()) text += "; lost and reported: " + listed(fates.reported);
  if (!fates.silent.empty()) text += "; lost without a word: " + listed(fates.silent);
  return text;
}

// The first body is back by the method that AUTO takes; by the others, and the second body, it may be lost, but then
// the world has said so.
Result recovers_or_reports(const char* file, bool quick) {
  const Scene scene = scene_of(file);
  const std::vector<double> at_rest_m3 = volumes_at_rest_m3(scene);
  bool holds = true;
  std::vector<Fates> fates(scene.soft_bodies.size());
  std::string refused;
  for (const Integrator integrator : every_integrator) {
    Run run(with_integrator(scene, integrator));
    if (!run.refusal().empty()) {
      holds = holds && integrator != Integrator::automatic;
      refused.append(refused.empty() ? "; refused: " : ", ").append(method_name(integrator));
      continue;
    }
    run.seconds(settling_s(quick));
    holds = holds && run.is_finite();
    for (std::size_t i = 0; i < at_rest_m3.size(); ++i) {
      ++fates[i].runs;
      const double share = run.world().measure(i).volume_m3 / at_rest_m3[i];
      if (std::abs(share - 1.0) <= 1.0 - recovered_share) {
        ++fates[i].back;
        continue;
      }
      const bool reported = run.has_reported(scene.soft_bodies[i].name);
      holds = holds && reported && (i > 0 || integrator != Integrator::automatic);
      const std::string how = run.world().is_frozen(i) ? "frozen" : percent(share) + " of V";
      (reported ? fates[i].reported : fates[i].silent).push_back(method_name(integrator) + " (" + how + ")");
    }
  }
  std::string text;
  for (std::size_t i = 0; i < fates.size(); ++i) {
    text.append(i == 0 ? "\"" : "; \"").append(scene.soft_bodies[i].name).append("\": ").append(words_of(fates[i]));
  }
  return {holds, text + refused};
}

Result degenerate(bool quick) {
  for (const char* file : {"11-zero-area-face.json", "11-zero-length-edge.json"}) {
    const base::Result<Scene> scene = load(file);
    if (scene.ok() || scene.status().message().find("has zero area") == std::string::npos) {
      return {false, std::string(file) + " is not refused for its area"};
    }
  }
  Result reached = recovers(degenerate_scene, quick);
  reached.figure = "refused, naming the face; reached by motion: " + reached.figure;
  return reached;
}

std::string shapes_in_bullet(const char* file) {
  std::ostringstream text;
  for (const physics::SoftBody& body : scene_of(file).soft_bodies) {
    physics::SoftBody at_rest = body;
    at_rest.start_positions_m.clear();
    const auto volume_m3 = [&](const physics::SoftBody& from) {
      bench::BulletBall peer = bullet_ball(from, 1.0 / 60.0, {.link_stiffness = 1.0});
      for (int i = 0; i < 600; ++i) peer.step();
      return physics::signed_volume_m3(peer.positions_m(), body.mesh->faces);
    };
    const double share = volume_m3(body) / volume_m3(at_rest);
    if (text.tellp() > 0) text << ", ";
    text << '"' << body.name << "\" ends at ";
    if (std::isfinite(share)) {
      text << percent(share) << " of its volume at rest";
    } else {
      text << "NaN";
    }
  }
  return text.str();
}

}  // namespace

std::vector<ExtremeCase> shape_cases() {
  return {{.number = 6,
           .name = "squeezed to 1 % of its volume, evenly or flat",
           .scene = squeezed_scene,
           .criterion = "recovers 99 % of its volume",
           .run = [](bool quick) { return recovers(squeezed_scene, quick); },
           .bullet = [] { return shapes_in_bullet(squeezed_scene); }},
          {.number = 7,
           .name = "turned inside out",
           .scene = inside_out_scene,
           .criterion = "finite; recovers by AUTO, by others it may report that it does not",
           .run = [](bool quick) { return recovers_or_reports(inside_out_scene, quick); },
           .bullet = [] { return shapes_in_bullet(inside_out_scene); }},
          {.number = 11,
           .name = "zero-area face, zero-length edge",
           .scene = degenerate_scene,
           .criterion = "refused in a mesh; reached by motion: finite, recovers 99 % of its volume",
           .run = degenerate,
           .bullet = [] { return shapes_in_bullet(degenerate_scene); }},
          {.number = 18,
           .name = "vertices scrambled, or all at one point",
           .scene = scrambled_scene,
           .criterion = "finite; scrambled recovers by AUTO, else it is reported",
           .run = [](bool quick) { return recovers_or_reports(scrambled_scene, quick); },
           .bullet = [] { return shapes_in_bullet(scrambled_scene); }}};
}

}  // namespace pneuma::extremes
