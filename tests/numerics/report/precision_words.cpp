#include "numerics/report/precision_words.h"

#include <algorithm>

#include "numerics/report/methods.h"

namespace pneuma::report::precision {

namespace {

void append_item(std::string& list, const std::string& item, const char* separator = "; ") {
  list.append(list.empty() ? "" : separator).append(item);
}

// A bullet for each method that is the cheapest somewhere.
void write_winners(Page& page, const std::vector<Verdict>& rows, const Run* Verdict::* winner,
                   const std::string& within) {
  for (const physics::Integrator integrator : every_integrator) {
    std::string where;
    for (const Verdict& row : rows) {
      const Run* run = row.*winner;
      if (run == nullptr || run->setting.integrator != integrator) continue;
      append_item(where, row.judged->title + " (" + std::to_string(run->setting.substeps) + " a tick, " +
                             milliseconds(run->cpu_ms_per_s) + ")");
    }
    if (where.empty()) continue;
    page.bullet("**" + title_of(integrator) + "** costs least " + within + " for: " + where + ".");
  }
  std::string nowhere;
  for (const Verdict& row : rows) {
    if (row.*winner == nullptr) append_item(nowhere, row.judged->title);
  }
  if (!nowhere.empty()) page.bullet("No run here came " + within + " for: " + nowhere + ".");
}

void write_automatic(Page& page, const std::vector<Verdict>& rows) {
  std::vector<double> ratios;
  std::string missed;
  const Verdict* dearest = nullptr;
  for (const Verdict& row : rows) {
    if (!row.holds_target()) {
      append_item(missed, row.judged->title + " (" + share(row.error) + ")");
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
    text += ", where it took " + number(ratios[ratios.size() / 2], 2) +
            " times as long as the cheapest run within 1 % in the middle one, and " +
            number(dearest->ratio_to(dearest->within_percent), 2) + " times in the dearest (" + dearest->judged->title +
            ")";
  }
  page.bullet(text + ". So leave `integrator` at `AUTO` unless your scene is one of those below.");
  if (!missed.empty()) page.bullet("`AUTO` missed its 1 % for: " + missed + ".");
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

}  // namespace

void write_advice(Page& page, const std::vector<Verdict>& rows) {
  page.subheading("Which method for which scene");
  write_automatic(page, rows);
  write_winners(page, rows, &Verdict::within_percent, "within 1 %");
  write_winners(page, rows, &Verdict::within_per_mille, "within 0.1 %");
  write_losers(page, rows);
}

}  // namespace pneuma::report::precision
