// Shows that the report's page, CSV files and comparison with the outcomes of before say what they are given, that an
// interrupted report leaves the last one, and that no case counts whose reference did not converge.
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include <gtest/gtest.h>

#include "numerics/report/csv.h"
#include "numerics/report/outcomes.h"
#include "numerics/report/page.h"
#include "numerics/report/precision_hindsight.h"
#include "numerics/report/unfinished_folder.h"
#include "support/temporary_folder.h"

namespace pneuma::report {
namespace {

TEST(Number, HasSoManySignificantDigitsOrHasFailed) {
  EXPECT_EQ(number(0.0012345), "0.00123");
  EXPECT_EQ(number(1.26e-9, 2), "1.3e-09");
  EXPECT_EQ(number(1725.0, 2), "1700");
  EXPECT_EQ(number(99.7, 2), "100");
  EXPECT_EQ(number(2.5e7, 2), "2.5e+07");
  EXPECT_EQ(number(std::numeric_limits<double>::infinity()), "failed");
  EXPECT_EQ(percent(0.005), "0.5 %");
  EXPECT_EQ(percent(std::numeric_limits<double>::quiet_NaN()), "failed");
}

TEST(Page, SetsColumnsOfNumbersFlushRight) {
  Page page;
  page.table({"method", "error"}, {{"RK4", "1e-09"}, {"XPBD", "0.5 %"}});
  EXPECT_EQ(page.markdown(), "| method | error |\n| --- | ---: |\n| RK4 | 1e-09 |\n| XPBD | 0.5 % |\n");
}

TEST(Page, LeavesAColumnWithAWordFlushLeft) {
  Page page;
  page.table({"error"}, {{"1e-09"}, {"failed"}});
  EXPECT_EQ(page.markdown(), "| error |\n| --- |\n| 1e-09 |\n| failed |\n");
}

TEST(Page, SetsABlankLineBetweenBlocksAndNoneWithinAList) {
  Page page;
  page.heading("Order");
  page.bullet("one");
  page.bullet("two");
  page.paragraph("End.");
  EXPECT_EQ(page.markdown(), "## Order\n\n- one\n- two\n\nEnd.\n");
}

TEST(Csv, QuotesWhatWouldBeReadAsMoreThanOneCell) {
  const support::TemporaryFolder folder;
  const std::filesystem::path path = folder / "csv/a.csv";
  Csv csv(path, {"case", "error"});
  csv.row({"ball, \"large\"", 0.1});
  csv.row({"plain", 1e-300});
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  EXPECT_EQ(text.str(), "case,error\n\"ball, \"\"large\"\"\",0.1\nplain,1e-300\n");
}

TEST(Csv, NamesTheFileThatCannotBeWritten) {
  const support::TemporaryFolder folder;
  const std::filesystem::path path = folder / "taken";
  std::filesystem::create_directories(path);
  try {
    const Csv csv(path, {"case"});
    FAIL() << "a folder was written to";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos);
  }
}

std::string text_of_file(const std::filesystem::path& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

TEST(UnfinishedFolder, LeavesWhatWasThereUntilItIsFinished) {
  const support::TemporaryFolder folder;
  const std::filesystem::path target = folder.path();
  const auto write = [](const std::filesystem::path& folder, const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder / name).parent_path());
    std::ofstream(folder / name) << text;
  };
  write(target, "page", "old");
  write(target, "plots/gone", "old");
  write(target, "quick/page", "another");
  {
    const UnfinishedFolder interrupted(target);
    write(interrupted.path(), "page", "half");
    write(interrupted.path(), "left", "half");
  }
  EXPECT_EQ(text_of_file(target / "page"), "old");
  const UnfinishedFolder unfinished(target);
  write(unfinished.path(), "page", "new");
  write(unfinished.path(), "plots/here", "new");
  unfinished.finish();
  EXPECT_EQ(text_of_file(target / "page"), "new");
  EXPECT_EQ(text_of_file(target / "plots/here"), "new");
  EXPECT_FALSE(std::filesystem::exists(target / "plots/gone"));
  EXPECT_FALSE(std::filesystem::exists(target / "left"));
  EXPECT_FALSE(std::filesystem::exists(unfinished.path()));
  EXPECT_EQ(text_of_file(target / "quick/page"), "another");
}

TEST(Verdicts, AreOfCasesWhoseReferenceConverged) {
  using namespace precision;
  std::vector<Measured> all(2);
  for (Measured& measured : all) {
    measured.subject.judged = {{.name = "ball", .title = "Ball", .error = &Errors::position, .label = "error"}};
    precision::Run& run = measured.runs.emplace_back();
    run.chosen = true;
    run.errors.position = 0.001;
  }
  all[1].reference.converged = true;
  const std::vector<Verdict> rows = verdicts(all);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].measured, &all[1]);
  EXPECT_TRUE(rows[0].holds_target());
}

std::vector<std::string> changes_from(const std::vector<Outcome>& before, const std::vector<Outcome>& now) {
  std::istringstream expected(text_of(before));
  return changes(expected, now);
}

TEST(Outcomes, DoNotChangeWithTheirOrder) {
  EXPECT_TRUE(changes_from({{"a", "holds"}, {"b", "order 2"}}, {{"b", "order 2"}, {"a", "holds"}}).empty());
}

TEST(Outcomes, TellWhatChangedIsGoneAndIsNew) {
  const std::vector<std::string> lines =
      changes_from({{"a", "holds"}, {"b", "stable"}, {"c", "holds"}}, {{"a", "fails"}, {"c", "holds"}, {"d", "holds"}});
  EXPECT_EQ(lines,
            (std::vector<std::string>{"a: was holds, is fails", "b: was stable, is not there", "d: is new, holds"}));
}

}  // namespace
}  // namespace pneuma::report
