// Runs the benchmarks and prints, at the end, each figure beside its target, with the median where a benchmark was
// repeated.
#include <algorithm>
#include <array>
#include <cstdio>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/figures.h"
#include "bench/median.h"

namespace pneuma::bench {

namespace {

std::vector<Figure>& figures() {
  static std::vector<Figure> all;
  return all;
}

// Prints as the console reporter does, and keeps every counter of every single run.
class FigureReporter : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
      for (const auto& [name, counter] : run.counters)
        values_[run.run_name.function_name + "/" + run.run_name.args][name].push_back(counter.value);
    }
  }

  /// Of what was run; with `all`, those that nothing measured too.
  void print_figures(bool all) const {
    std::printf("\n%-64s %12s %12s  %s\n", "figure (median of repetitions)", "measured", "target", "held");
    for (const Figure& figure : figures()) {
      const std::vector<double>* values = values_of(figure);
      if (values == nullptr) {
        if (all) std::printf("%-64s %12s\n", figure.meaning.c_str(), "not measured");
        continue;
      }
      const double measured = median(*values);
      const bool at_least = figure.bound == Bound::at_least;
      const bool held = at_least ? measured >= figure.target : measured <= figure.target;
      std::printf("%-64s %12.4g %s %10.4g  %s\n", figure.meaning.c_str(), measured,
                  at_least ? ">=" : "<=", figure.target, held ? "yes" : "NO");
    }
  }

 private:
  [[nodiscard]] const std::vector<double>* values_of(const Figure& figure) const {
    const auto benchmark = values_.find(figure.benchmark);
    if (benchmark == values_.end()) return nullptr;
    const auto counter = benchmark->second.find(figure.counter);
    return counter == benchmark->second.end() ? nullptr : &counter->second;
  }

  std::map<std::string, std::map<std::string, std::vector<double>>> values_;
};

// One name a line, on standard error.
void list_benchmarks(FigureReporter& reporter) {
  std::string program = "pneuma-bench";
  std::string flag = "--benchmark_list_tests";
  std::array<char*, 3> arguments{program.data(), flag.data(), nullptr};
  int count = 2;
  benchmark::Initialize(&count, arguments.data());
  reporter.SetOutputStream(&std::cerr);
  benchmark::RunSpecifiedBenchmarks(&reporter, ".");
}

}  // namespace

bool expect(Figure figure) {
  figures().push_back(std::move(figure));
  return true;
}

}  // namespace pneuma::bench

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  pneuma::bench::FigureReporter reporter;
  if (benchmark::RunSpecifiedBenchmarks(&reporter) == 0) {
    std::fprintf(stderr, "pneuma-bench: no benchmark matches; there are:\n");
    pneuma::bench::list_benchmarks(reporter);
    return 1;
  }
  const std::string filter = benchmark::GetBenchmarkFilter();
  reporter.print_figures(filter.empty() || filter == "." || filter == "all");
  benchmark::Shutdown();
  return 0;
}
