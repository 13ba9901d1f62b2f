#include <algorithm>
#include <cmath>

#include "numerics/report/methods.h"
#include "numerics/report/precision_words.h"

namespace pneuma::report::precision {

using physics::Integrator;

namespace {

std::string with_time(const Run* run) {
  if (run == nullptr) return "none here";
  return describe(*run).append(": ").append(milliseconds(run->cpu_ms_per_s));
}

std::string ratio_cell(const Verdict& row, const Run* run) {
  return run == nullptr ? "-" : number(row.ratio_to(run), 2);
}

constexpr double round_off = 1e-12;

std::string cell(double value) {
  if (std::isnan(value)) return "-";
  return value < round_off ? "round-off" : number(value, 2);
}

/// Where bodies are and what they keep, in two tables: one would be too wide for a phone.
class MeasuresTables {
 public:
  explicit MeasuresTables(std::string first) : first_(std::move(first)) {}

  void add(const std::string& first, const Run& run) {
    if (!run.failure.empty()) {
      places_.push_back({first, "failed", "-", "-", "-"});
      kept_.push_back({first, "failed", "-", "-"});
      return;
    }
    const Errors& errors = run.errors;
    places_.push_back({first, cell(errors.position), cell(errors.centre), cell(errors.volume), cell(errors.period)});
    kept_.push_back({first, cell(errors.energy), cell(errors.momentum), cell(errors.angular_momentum)});
  }
  void write(Page& page) const {
    page.table({first_, "position", "centre of mass", "volume", "period"}, places_);
    page.table({first_, "energy", "momentum", "angular momentum"}, kept_);
  }

 private:
  std::string first_;
  std::vector<std::vector<std::string>> places_;
  std::vector<std::vector<std::string>> kept_;
};

const Measured* find(const std::vector<Measured>& all, const std::string& name) {
  const auto found = std::ranges::find_if(all, [&](const Measured& each) { return each.subject.name == name; });
  return found == all.end() ? nullptr : &*found;
}

// The middle rung of each method that holds, and dearer rungs where it does not.
const Run* middle_rung(const Measured& measured, Integrator integrator) {
  std::vector<const Run*> rungs;
  for (const Run& run : measured.runs) {
    if (run.is_plain() && run.failure.empty() && run.setting.integrator == integrator) rungs.push_back(&run);
  }
  return rungs.empty() ? nullptr : rungs[rungs.size() / 2];
}

void write_iterations(Page& page, const std::vector<Measured>& all) {
  std::vector<std::vector<std::string>> rows;
  for (const Measured& measured : all) {
    if (measured.subject.rest_ticks > 0 || !measured.reference.converged) continue;  // where it rests: the same for any
    const Judged& judged = measured.subject.judged.front();
    for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2}) {
      std::vector<std::string> row{judged.title, title_of(integrator)};
      for (const Run& run : measured.runs) {
        if (run.setting.error_target != tight_target || run.setting.substeps != 1) continue;
        if (run.setting.integrator != integrator) continue;
        row.push_back(share(run.judged(judged.error)) + " in " + milliseconds(run.cpu_ms_per_s));
      }
      if (row.size() > 2) rows.push_back(std::move(row));
    }
  }
  if (rows.empty()) return;
  page.paragraph(
      "Newton's iterations, each case at one substep a tick and solved to 1e-6: error, and CPU time a simulated "
      "second.");
  page.table({"case", "method", "1 iteration", "2", "4", "8"}, rows);
}

}  // namespace

void write_verdicts(Page& page, const std::vector<Verdict>& rows) {
  std::vector<std::vector<std::string>> choices;
  std::vector<std::vector<std::string>> cheapest;
  for (const Verdict& row : rows) {
    choices.push_back({row.judged->title, describe(*row.automatic), share(row.error),
                       milliseconds(row.automatic->cpu_ms_per_s), with_time(row.as_exact),
                       ratio_cell(row, row.as_exact)});
    cheapest.push_back({row.judged->title, with_time(row.within_percent), ratio_cell(row, row.within_percent),
                        with_time(row.within_per_mille), ratio_cell(row, row.within_per_mille)});
  }
  page.paragraph(
      "What `AUTO` chose at its target of 1 %, how far off it was, and the cheapest run in hindsight that was as exact "
      "(or within 0.01 %, or three times the reference's own error). CPU times are for a simulated second. The ratio "
      "is "
      "AUTO's time over that run's: under 1, AUTO was faster than any step of the ladders that is as exact.");
  page.table({"case", "AUTO's choice", "its error", "CPU time", "best in hindsight", "ratio"}, choices);
  std::vector<std::vector<std::string>> reasons;
  for (const Verdict& row : rows) {
    if (row.judged == &row.measured->subject.judged.front())
      reasons.push_back({row.judged->title, row.automatic->reason});
  }
  page.paragraph("Why, in the words of `AUTO` itself (stats and `pneuma-sim` give them too):");
  page.table({"case", "reason"}, reasons);
  page.paragraph("The cheapest runs within 1 % and within 0.1 %, and AUTO's time over each.");
  page.table({"case", "within 1 %", "ratio", "within 0.1 %", "ratio"}, cheapest);
}

void write_measures(Page& page, const std::vector<Measured>& all) {
  page.subheading("What else is off");
  page.paragraph(
      "Root mean squares over the ticks of the difference from the reference. Each is relative: position and centre of "
      "mass to body size; volume and breathing period to their own; energy (with what dampers and the wind took) to "
      "the most that was kinetic, won or lost; momentum to mass times the greatest speed; angular momentum to that "
      "times body size. Round-off: under 1e-12. A dash: the case has none. First AUTO's runs, chosen as above:");
  MeasuresTables of_automatic("case");
  for (const Measured& measured : all) {
    if (measured.reference.converged) of_automatic.add(measured.subject.name, automatic(measured));
  }
  of_automatic.write(page);

  if (const Measured* ball = find(all, "ball"); ball != nullptr && ball->reference.converged) {
    page.paragraph("Every method on the breathing ball of 162 vertices, at the middle one of its steps that hold:");
    MeasuresTables of_methods("run");
    for (const Integrator integrator : every_integrator) {
      if (const Run* run = middle_rung(*ball, integrator)) of_methods.add(describe(*run), *run);
    }
    of_methods.write(page);
  }
  write_iterations(page, all);
}

void write_peers(Page& page, const std::vector<Measured>& all) {
  std::vector<std::vector<std::string>> rows;
  for (const Measured& measured : all) {
    if (measured.peers.empty()) continue;
    const std::string& title = measured.subject.judged.front().title;
    const auto add = [&](const std::string& program, double error, double cpu_ms_per_s) {
      rows.push_back({title, program, share(error), milliseconds(cpu_ms_per_s)});
    };
    const auto add_run = [&](const std::string& name, const Run& run) {
      add(name + describe(run), run.judged(&Errors::volume_at_rest), run.cpu_ms_per_s);
    };
    const auto ball = std::ranges::find(resting_balls(), measured.subject.name, &RestingBall::name);
    const double rest_m3 = measured.reference.trajectory.samples.back().soft.front().volume_m3;
    rows.push_back({title, "closed form for equal edges", share(std::abs(closed_form_m3(*ball) / rest_m3 - 1.0)), "-"});
    add_run("Pneuma, AUTO: ", automatic(measured));
    for (const Run& run : measured.runs) {
      if (run.is_plain() && run.setting.integrator == Integrator::xpbd && run.setting.substeps == 16) {
        add_run("Pneuma, ", run);
      }
    }
    for (const Peer& peer : measured.peers) {
      const std::string iterations = std::to_string(peer.iterations);
      add("Bullet, " + iterations + (peer.iterations == 1 ? " iteration" : " iterations"), peer.volume_error,
          peer.cpu_ms_per_s);
    }
  }
  if (rows.empty()) return;
  page.subheading("Stiff balls at rest, beside Bullet");
  page.paragraph(
      "A ball of 162 vertices, 1 kg and 1 m radius at 60 Hz, and the volume at which it comes to rest. Bullet's "
      "springs "
      "have no stiffness in N/m. Each iteration takes away a share of the strain, here all of it: the stiffest there "
      "is. "
      "So its balls are softer than asked for until the iterations are many. The closed form takes all springs as "
      "equally "
      "long.");
  page.table({"case", "program", "volume off by", "CPU time"}, rows);
}

void write_references(Page& page, const std::vector<Measured>& all) {
  page.subheading("What it is measured against");
  std::vector<std::vector<std::string>> rows;
  for (const Measured& measured : all) {
    const Reference& reference = measured.reference;
    const std::vector<Judged>& judged = measured.subject.judged;
    rows.push_back({measured.subject.name, measured.subject.words,
                    number(static_cast<double>(measured.subject.ticks) / rate_hz, 2),
                    std::to_string(reference.substeps),
                    (reference.converged ? "" : "**did not converge: invalid**, ") +
                        number(reference.halving.*judged.front().error, 2),
                    judged.size() > 1 ? number(reference.halving.*judged.back().error, 2) : "-",
                    number(reference.energy_drift, 2)});
  }
  page.paragraph(
      "RK4 in double precision, its step halved until that changes the measure by less than 1e-9. Where something "
      "touches, that holds until it does. After contact, trajectories are chaotic: only centres of mass, volume and "
      "energy "
      "are compared, and what halving changes there is the reference's own error. The last column is the change of the "
      "reference's energy over its greatest kinetic energy: near zero where nothing damps, blows or bounces. A short "
      "duration keeps such small steps affordable.");
  page.table(
      {"case", "what moves", "simulated s", "steps in 1/60 s", "halving changes", "after contact", "energy change"},
      rows);
}

}  // namespace pneuma::report::precision
