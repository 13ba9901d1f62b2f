#include "numerics/report/precision_words.h"

#include <algorithm>
#include <cmath>

#include "numerics/report/methods.h"

namespace pneuma::report::precision {

namespace {

void append_item(std::string& list, const std::string& item, const char* separator = "; ") {
  list.append(list.empty() ? "" : separator).append(item);
}

// "as long", "1.3 times as long".
std::string times_as_long(double ratio) {
  return std::abs(ratio - 1.0) < 0.05 ? "as long" : number(ratio, 2) + " times as long";
}

// A bullet for each method that is the cheapest somewhere, and one for what no run came near to.
void write_winners(Page& page, const std::vector<Verdict>& rows) {
  for (const physics::Integrator integrator : every_integrator) {
    std::string both;
    std::string percent_only;
    std::string per_mille_only;
    for (const Verdict& row : rows) {
      const auto wins = [&](const Run* run) { return run != nullptr && run->setting.integrator == integrator; };
      const bool percent = wins(row.within_percent);
      const bool per_mille = wins(row.within_per_mille);
      if (percent && per_mille) append_item(both, row.judged->title);
      if (percent && !per_mille) append_item(percent_only, row.judged->title);
      if (!percent && per_mille) append_item(per_mille_only, row.judged->title);
    }
    std::string where;
    if (!both.empty()) append_item(where, "within 1 % and 0.1 %: " + both, ". ");
    if (!percent_only.empty()) append_item(where, "within 1 %: " + percent_only, ". Only ");
    if (!per_mille_only.empty()) append_item(where, "within 0.1 %: " + per_mille_only, ". Only ");
    if (!where.empty()) page.bullet("**" + title_of(integrator) + "** costs least " + where + ".");
  }
  std::string nowhere;
  for (const Verdict& row : rows) {
    if (row.within_percent == nullptr) {
      append_item(nowhere, row.judged->title + " (1 %)");
    } else if (row.within_per_mille == nullptr) {
      append_item(nowhere, row.judged->title + " (0.1 %)");
    }
  }
  if (!nowhere.empty()) page.bullet("No run here came that near for: " + nowhere + ".");
}

void write_automatic(Page& page, const std::vector<Verdict>& rows) {
  std::vector<double> ratios;
  std::string missed;
  const Verdict* dearest = nullptr;
  for (const Verdict& row : rows) {
    if (!row.holds_target()) {
      append_item(missed, row.judged->title + " (off by " + share(row.error) +
                              (row.within_percent == nullptr ? "" : "; instead: " + describe(*row.within_percent)) +
                              ")");
    } else if (row.within_percent != nullptr) {
      ratios.push_back(row.ratio_to(row.within_percent));
      if (dearest == nullptr || ratios.back() > dearest->ratio_to(dearest->within_percent)) dearest = &row;
    }
  }
  std::string text = "**`AUTO`** came within its target of 1 % in " +
                     std::to_string(std::ranges::count_if(rows, &Verdict::holds_target)) + " of " +
                     std::to_string(rows.size()) + " rows";
  if (dearest != nullptr) {
    std::ranges::sort(ratios);
    text += ". There it took " + times_as_long(ratios[ratios.size() / 2]) +
            " as the cheapest run of a ladder that came within 1 % (the median; at worst " +
            times_as_long(dearest->ratio_to(dearest->within_percent)) + ": " + dearest->judged->title + ")";
  }
  page.bullet(text + ".");
  if (!missed.empty()) page.bullet("`AUTO` missed its 1 % for: " + missed + ".");
  page.bullet(missed.empty() ? "So set `integrator` to `AUTO`, unless you want another error: set `error_target`."
                             : "So set `integrator` to `AUTO`, unless your scene is like one that it missed.");
}

void write_losers(Page& page, const std::vector<Verdict>& rows) {
  std::string losers;
  for (const physics::Integrator integrator : every_integrator) {
    const auto by = [&](const Run* run) { return run != nullptr && run->setting.integrator == integrator; };
    if (std::ranges::none_of(rows,
                             [&](const Verdict& row) { return by(row.within_percent) || by(row.within_per_mille); })) {
      append_item(losers, title_of(integrator), ", ");
    }
  }
  if (!losers.empty()) page.bullet("Nowhere the cheapest, within 1 % or within 0.1 %: " + losers + ".");
}

// Ladders whose last rung is further off than one before it, by more than chance and the reference can make.
void write_divergent(Page& page, const std::vector<Verdict>& rows) {
  std::string worse;
  for (const Verdict& row : rows) {
    const double known = 3.0 * row.measured->reference.halving.*row.judged->error;
    for (const physics::Integrator integrator : every_integrator) {
      const Run* best = nullptr;
      const Run* last = nullptr;
      for (const Run& run : row.measured->runs) {
        if (!run.is_plain() || run.setting.integrator != integrator) continue;
        last = &run;
        if (best == nullptr || run.judged(row.judged->error) < best->judged(row.judged->error)) best = &run;
      }
      const double end = last->judged(row.judged->error);
      if (end > 1e-4 && end > known && end > 3.0 * best->judged(row.judged->error)) {
        append_item(worse, title_of(integrator) + " on " + row.judged->title + " (" +
                               share(best->judged(row.judged->error)) + " at " +
                               std::to_string(best->setting.substeps) + " a tick, " + share(end) + " at " +
                               std::to_string(last->setting.substeps) + ")");
      }
    }
  }
  if (!worse.empty()) page.bullet("More substeps made it worse: " + worse + ".");
}

}  // namespace

void write_advice(Page& page, const std::vector<Verdict>& rows) {
  page.subheading("Which method for which scene");
  write_automatic(page, rows);
  write_winners(page, rows);
  write_losers(page, rows);
  write_divergent(page, rows);
}

}  // namespace pneuma::report::precision
