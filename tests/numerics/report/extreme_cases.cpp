#include <mutex>

#include "numerics/extremes/extreme_case.h"
#include "numerics/report/part.h"

namespace pneuma::report {
namespace {

using extremes::ExtremeCase;

/// "13 and 14".
std::string listed(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " and " : ", ";
    text += words[i];
  }
  return text;
}

std::string summary(std::size_t cases, const std::vector<std::string>& failing, bool quick) {
  std::string text = std::to_string(cases - failing.size());
  text.append(" of ").append(std::to_string(cases)).append(" cases hold");
  if (!failing.empty()) {
    text.append("; ").append(listed(failing)).append(failing.size() == 1 ? " does not" : " do not");
    text.append(", and the figure says in which runs and how");
  }
  return text +
         ". Each is a scene file of `tests/numerics/scenes`; a case that runs in several ways (integrators, "
         "precisions) holds where all of them do. A test fails where a case comes out otherwise. Bullet runs with its "
         "own settings for the same scene; a dash: it was not run." +
         (quick ? " This is a quick page: long cases ran for some seconds, not for all the time that they name." : "");
}

std::vector<extremes::Result> results_of(const std::vector<ExtremeCase>& cases, Context& context) {
  std::vector<extremes::Result> results(cases.size());
  std::mutex telling;
  std::size_t done = 0;
  const auto run = [&](std::size_t i) {
    results[i] = cases[i].run(context.quick);
    const std::lock_guard lock(telling);
    context.progress.advance(static_cast<double>(++done) / static_cast<double>(cases.size()));
  };
  context.workers.for_each(cases.size(), [&](std::size_t i) {
    if (!cases[i].alone) run(i);
  });
  for (std::size_t i = 0; i < cases.size(); ++i) {
    if (cases[i].alone) run(i);
  }
  return results;
}

void run_extreme_cases(Context& context) {
  Csv csv = context.csv("extreme_cases", {"number", "case", "criterion", "outcome", "figure", "bullet"});
  const std::vector<ExtremeCase>& cases = extremes::extreme_cases();
  const std::vector<extremes::Result> results = results_of(cases, context);
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> failing;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const ExtremeCase& extreme = cases[i];
    const extremes::Result& result = results[i];
    const std::string outcome = result.holds ? "holds" : "fails";
    const std::string number = std::to_string(extreme.number);
    const std::string bullet = extreme.bullet ? extreme.bullet() : "-";
    if (!result.holds) failing.push_back(number);
    rows.push_back({number, extreme.name, extreme.criterion, outcome, result.figure, bullet});
    csv.row({static_cast<double>(extreme.number), extreme.name, extreme.criterion, outcome, result.figure, bullet});
  }
  context.page.heading("Extreme cases");
  context.page.paragraph(summary(cases.size(), failing, context.quick));
  context.page.table({"number", "case", "criterion", "outcome", "figure", "Bullet"}, rows);
}

}  // namespace

Part extreme_cases() {
  return {
      .name = "extreme-cases", .title = "Extreme cases", .quick_s = 30.0, .full_s = 240.0, .run = run_extreme_cases};
}

}  // namespace pneuma::report
