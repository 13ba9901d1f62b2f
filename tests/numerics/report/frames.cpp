#include <cmath>
#include <string>
#include <vector>

#include "bench/frame_costs.h"
#include "numerics/report/part.h"

namespace pneuma::report {
namespace {

using bench::FrameCost;
using bench::PeerBits;
using support::Recording;

struct Streamed {
  std::string name;   // of a built-in scene
  std::string title;  // "a bouncing ball of 162 vertices, 1 m across"
};

// By plot style: ours first, as in every plot of the page.
enum PeerStyle { ours, zstd, meshoptimizer, draco };

struct Rung {
  double max_error_m = 0.0;
  FrameCost cost;
  PeerBits peers;
};

/// Half an order of magnitude apart.
std::vector<double> bounds_m(bool quick) {
  if (quick) return {1e-3, 1e-4};
  return {1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5};
}

Plot plot_of(const Streamed& subject, const std::vector<Rung>& rungs) {
  Plot plot;
  plot.title = std::string("Frames of ").append(subject.name).append(" at 60 Hz");
  plot.x = {.label = "error bound (mm)", .log = true};
  plot.y = {.label = "bits / vertex / frame"};
  plot.commands = {"set yrange [0:*]", "set key maxcols 1 width 0", "set title noenhanced"};
  const auto series = [&](const std::string& label, PeerStyle style, const auto& bits_of) {
    Series line{.label = label, .style = style, .points = {}};
    for (const Rung& rung : rungs) line.points.emplace_back(1e3 * rung.max_error_m, bits_of(rung));
    plot.series.push_back(std::move(line));
  };
  series("Pneuma", ours, [](const Rung& rung) { return rung.cost.bits; });
  series("zstd -19", zstd, [](const Rung& rung) { return rung.peers.zstd; });
  series("meshoptimizer + zstd", meshoptimizer, [](const Rung& rung) { return rung.peers.meshoptimizer; });
  series("Draco", draco, [](const Rung& rung) { return rung.peers.draco; });
  return plot;
}

void write_sizes(Context& context, const std::vector<Streamed>& subjects) {
  context.page.subheading("Bits against error");
  Csv csv = context.csv("frames", {"scene", "max_error_m", "bits", "zstd_bits", "meshoptimizer_bits", "draco_bits",
                                   "write_ns", "read_ns", "error_max_m"});
  std::vector<std::vector<std::string>> rows;
  const std::size_t ticks = context.quick ? 60 : 300;
  double done = 0.0;
  for (const Streamed& subject : subjects) {
    const Recording recording = support::record(support::world_of(subject.name), ticks);
    std::vector<Rung> rungs;
    for (const double max_error_m : bounds_m(context.quick)) {
      const Rung rung{max_error_m, bench::frame_cost(recording, max_error_m), bench::peer_bits(recording, max_error_m)};
      csv.row({subject.name, max_error_m, rung.cost.bits, rung.peers.zstd, rung.peers.meshoptimizer, rung.peers.draco,
               rung.cost.write_ns, rung.cost.read_ns, rung.cost.error_max_m});
      const std::string bound = number(1e3 * max_error_m).append(" mm");
      rows.push_back({std::string("`").append(subject.name).append("`"), bound, fixed(rung.cost.bits, 1),
                      fixed(rung.peers.zstd, 1), fixed(rung.peers.meshoptimizer, 1), fixed(rung.peers.draco, 1),
                      fixed(rung.cost.bits / rung.peers.least(), 2), percent(rung.cost.error_max_m / max_error_m)});
      context.outcomes.push_back({std::string("frames ").append(subject.name).append(" ").append(bound).append(" bits"),
                                  number(std::round(rung.cost.bits))});
      if (rung.cost.error_max_m > max_error_m) {
        context.faults.push_back(
            std::string("frames of ").append(subject.name).append(": past the bound ").append(bound));
      }
      rungs.push_back(rung);
      done += 0.8 / static_cast<double>(subjects.size() * bounds_m(context.quick).size());
      context.progress.advance(done);
    }
    context.figure(
        std::string("frames-").append(subject.name), plot_of(subject, rungs),
        std::string("Bits a vertex a frame against the bound on the error: ").append(subject.title).append("."));
  }
  context.page.table({"scene", "bound", "Pneuma", "zstd -19", "meshoptimizer + zstd", "Draco", "over the best peer",
                      "largest error / bound"},
                     rows);
}

// Balls of ten times and more the vertices, in flight.
void write_times(Context& context) {
  context.page.subheading("Time to write and to read");
  constexpr double max_error_m = 1e-4;
  Csv csv = context.csv("frame-times", {"vertices", "write_ns", "read_ns"});
  Plot plot;
  plot.title = "Time a vertex, bound 0.1 mm";
  plot.x = {.label = "vertices", .log = true};
  plot.y = {.label = "ns / vertex"};
  plot.commands = {"set yrange [0:*]", "set key maxcols 1 width 0"};
  plot.series = {{.label = "write", .style = ours, .points = {}}, {.label = "read", .style = zstd, .points = {}}};
  std::vector<std::vector<std::string>> rows;
  const int subdivisions_max = context.quick ? 3 : 6;
  for (int subdivisions = 1; subdivisions <= subdivisions_max; ++subdivisions) {
    const std::vector<std::string> assignments{
        std::string("meshes[0].icosphere.subdivisions=").append(std::to_string(subdivisions)), "stepping.substeps=0"};
    const Recording recording = support::record(support::world_of("bouncing-ball", assignments), 60);
    const FrameCost cost = bench::frame_cost(recording, max_error_m);
    const auto vertices = static_cast<double>(recording.vertex_count());
    csv.row({vertices, cost.write_ns, cost.read_ns});
    plot.series[0].points.emplace_back(vertices, cost.write_ns);
    plot.series[1].points.emplace_back(vertices, cost.read_ns);
    rows.push_back({number(vertices, 6), number(cost.write_ns), number(cost.read_ns), fixed(cost.bits, 1)});
    context.progress.advance(0.8 + 0.2 * subdivisions / subdivisions_max);
  }
  context.figure("frame-times", plot, "One frame of a ball in flight, by one thread: the median of sixty.");
  context.page.table({"vertices", "write (ns a vertex)", "read (ns a vertex)", "bits a vertex"}, rows);
}

void run_frames(Context& context) {
  context.page.heading("Frames");
  context.page.paragraph(
      "What a delta frame of the stream takes on the wire, everything in it counted, over recorded built-in scenes; "
      "and what "
      "general and mesh compressors make of the same motion, quantised to the same bound and less where linear motion "
      "would have taken it (without what would carry them). Every vertex of every frame is read back and "
      "compared with where it was: the last column is the largest distance, which may not pass the bound.");
  std::vector<Streamed> subjects{{"bouncing-ball", "a ball of 162 vertices, 1 m across, dropped on a floor"}};
  if (!context.quick) {
    subjects.push_back({"five-balls", "five such balls in a rotating room"});
    subjects.push_back({"hand", "1,159 vertices, 0.2 m long, hit by a rigid ball"});
  }
  write_sizes(context, subjects);
  write_times(context);
}

}  // namespace

Part frames() {
  return {.name = "frames", .title = "Frames", .quick_s = 3.0, .full_s = 60.0, .run = run_frames};
}

}  // namespace pneuma::report
