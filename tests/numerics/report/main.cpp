// pneuma-report: runs the parts of the numerical report and writes the page, its plots and CSV files.
#include <algorithm>
#include <fstream>
#include <iostream>
#include <iterator>
#include <thread>

#include <CLI/CLI.hpp>

#include "numerics/report/outcomes.h"
#include "numerics/report/part.h"
#include "numerics/report/unfinished_folder.h"

namespace pneuma::report {
namespace {

std::vector<Part> all_parts() {
  return {work_precision(), volume_methods(), observed_order(), stability_map(), contact(),
          extreme_cases(),  left_out(),       frames(),         soak()};
}

void write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
}

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

std::string preface(bool quick) {
  std::string text = "# Numerical report\n\n";
  text.append("Written by `./dev report").append(quick ? " --quick" : "").append("`. Processor: ").append(processor());
  text.append(", ").append(std::to_string(std::thread::hardware_concurrency())).append(" hardware threads.");
  text.append(
      " Times are CPU times of one thread; they vary from run to run, so compare them within this page only. Pneuma's "
      "errors, orders and outcomes come out the same in every run. The points of each plot lie in `csv/` beside the "
      "page where the report is run.\n");
  return text;
}

struct Options {
  std::string folder = "report";
  std::string expected;
  std::vector<std::string> only;
  std::vector<std::string> except;
  bool quick = false;
  bool png = false;
};

int run(const Options& options) {
  std::vector<Part> parts = all_parts();
  if (!options.only.empty()) {
    std::erase_if(parts,
                  [&](const Part& part) { return std::ranges::find(options.only, part.name) == options.only.end(); });
  }
  std::erase_if(parts,
                [&](const Part& part) { return std::ranges::find(options.except, part.name) != options.except.end(); });
  const auto expected_s = [&](const Part& part) { return options.quick ? part.quick_s : part.full_s; };
  double total_s = 0.0;
  for (const Part& part : parts) total_s += expected_s(part);

  const UnfinishedFolder unfinished(options.folder);
  Progress progress(total_s);
  physics::Workers workers(std::max(1u, std::thread::hardware_concurrency()));
  std::string page = preface(options.quick);
  std::vector<Outcome> outcomes;
  std::vector<std::string> wrong;
  for (const Part& part : parts) {
    progress.begin(part.title, expected_s(part));
    Context context(unfinished.path(), options.quick, options.png, progress, workers);
    part.run(context);
    progress.end();
    page.append("\n").append(context.page.markdown());
    outcomes.insert(outcomes.end(), context.outcomes.begin(), context.outcomes.end());
    wrong.insert(wrong.end(), context.faults.begin(), context.faults.end());
  }
  write_file(unfinished.path() / "REPORT.md", page);
  write_file(unfinished.path() / "outcomes.tsv", text_of(outcomes));
  unfinished.finish();
  std::cout << (std::filesystem::path(options.folder) / "REPORT.md").string() << '\n';

  if (!options.expected.empty()) {
    std::ifstream expected(options.expected);
    if (!expected) throw std::runtime_error(options.expected + ": cannot be read");
    std::ranges::move(changes(expected, outcomes), std::back_inserter(wrong));
  }
  for (const std::string& line : wrong) std::cerr << "pneuma-report: " << line << '\n';
  return wrong.empty() ? 0 : 1;
}

}  // namespace

void Context::figure(std::string_view name, const Plot& plot, std::string_view caption) {
  draw(plot, folder_ / "plots", std::string(name), png_);
  page.image(std::string("plots/").append(name).append(".svg"), caption);
}

}  // namespace pneuma::report

int main(int argc, char** argv) {
  pneuma::report::Options options;
  CLI::App app(
      "Error against run time, stability, extreme cases and what a scene leaves out: CSV, plots and one page.");
  app.add_option("--out", options.folder, "The folder to write to")->capture_default_str();
  app.add_flag("--quick", options.quick, "Fewer cases and shorter ladders, in under two minutes");
  std::vector<std::string> names;
  for (const pneuma::report::Part& part : pneuma::report::all_parts()) names.push_back(part.name);
  app.add_option("--only", options.only, "A part alone (repeatable)")->check(CLI::IsMember(names));
  app.add_option("--except", options.except, "All but this part (repeatable)")->check(CLI::IsMember(names));
  app.add_flag("--png", options.png, "Each plot as PNG too");
  app.add_option("--expect", options.expected,
                 "Fail where a row's outcome is not the one in this file (outcomes.tsv of a run)")
      ->check(CLI::ExistingFile);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    return pneuma::report::run(options);
  } catch (const std::exception& error) {
    std::cerr << "pneuma-report: " << error.what() << '\n';
    return 1;
  }
}
