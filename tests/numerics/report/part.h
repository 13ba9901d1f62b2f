// One part of the report: what it measures, it writes into the page, plots and CSV files.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "numerics/report/csv.h"
#include "numerics/report/outcomes.h"
#include "numerics/report/page.h"
#include "numerics/report/plot.h"
#include "numerics/report/progress.h"
#include "physics/machine/workers.h"

namespace pneuma::report {

class Context {
 public:
  Context(std::filesystem::path folder, bool quick, bool png, Progress& progress, physics::Workers& workers)
      : quick(quick), progress(progress), workers(workers), folder_(std::move(folder)), png_(png) {}

  const bool quick;           // in under two minutes for all parts: fewer cases, shorter ladders
  Progress& progress;         // advance(share) of this part, as it goes
  physics::Workers& workers;  // for what is not timed: while a time is taken, nothing else runs

  Page page;
  std::vector<Outcome> outcomes;
  std::vector<std::string> faults;  // what makes rows of the page invalid: the run fails, whatever is expected

  /// csv/NAME.csv below the report's folder.
  [[nodiscard]] Csv csv(std::string_view name, const std::vector<std::string>& columns) const {
    return {folder_ / "csv" / (std::string(name) + ".csv"), columns};
  }
  /// Draws plots/NAME.svg and puts it into the page, its caption below it.
  void figure(std::string_view name, const Plot& plot, std::string_view caption);

 private:
  std::filesystem::path folder_;
  bool png_;
};

struct Part {
  std::string name;   // for --only
  std::string title;  // in the progress bar
  double quick_s = 1.0;
  double full_s = 1.0;  // about how long it takes: the progress bar's share
  std::function<void(Context&)> run;
};

// The parts in the order of the page, each in a source of its own.
[[nodiscard]] Part work_precision();
[[nodiscard]] Part volume_methods();
[[nodiscard]] Part observed_order();
[[nodiscard]] Part stability_map();
[[nodiscard]] Part contact();
[[nodiscard]] Part extreme_cases();
[[nodiscard]] Part left_out();
[[nodiscard]] Part frames();
[[nodiscard]] Part soak();

}  // namespace pneuma::report
