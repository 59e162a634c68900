// The file that keeps finished runs: what it survives and what it refuses.
#include "tools/sweep/sweep_results.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <iterator>

#include "components/framework/configuration/configuration.h"
#include "tools/sweep/sweep_session.h"
#include "tools/sweep/sweep_table.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

class SweepResultsTest : public testing::Test {
 protected:
  SweepResultsTest() {
    std::string name = (fs::temp_directory_path() / "poise_sweep_XXXXXX").string();
    folder_ = mkdtemp(name.data());
    header_.kind = kKindSweep;
    ParseTextProto("name: 'test' vary { name: 'a' from: 0 to: 1 steps: 4 }", "test",
                   &header_.sweep);
    header_.columns = {"fallen"};
    header_.digest = "d";
    header_.program = "p";
  }
  ~SweepResultsTest() override { fs::remove_all(folder_); }

  static SweepRow Row(int64_t run, double metric) {
    SweepRow row;
    row.run = run;
    row.outcome = kFell;
    row.fell_at = 0.1 + 0.2;  // not 0.3: every digit counts
    row.ended_at = 1.0 / 3;
    row.phase = "stand, \"still\"";
    row.reason = "fell \xff";  // not UTF-8
    row.metrics["fallen"] = metric;
    return row;
  }
  std::string Text() const {
    std::ifstream in(folder_ / kResultsFile, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void SetText(const std::string& text) const {
    std::ofstream(folder_ / kResultsFile, std::ios::binary) << text;
  }
  void WriteRows(int64_t count) const {
    SweepResultsWriter writer(folder_, header_, {});
    for (int64_t run = 0; run < count; ++run) {
      writer.Append(Row(run, static_cast<double>(run) / 7));
    }
  }
  std::string Problem() const {
    try {
      ReadResults(folder_);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_;
  SweepHeader header_;
};

TEST_F(SweepResultsTest, KeepsEveryDigit) {
  WriteRows(3);
  const std::optional<SweepResults> results = ReadResults(folder_);
  ASSERT_TRUE(results);
  EXPECT_EQ(results->size, Text().size());
  ASSERT_EQ(results->rows.size(), 3u);
  const SweepRow& row = results->rows.at({2, 0});
  EXPECT_EQ(*row.fell_at, 0.1 + 0.2);
  EXPECT_EQ(row.ended_at, 1.0 / 3);
  EXPECT_EQ(row.metrics.at("fallen"), 2.0 / 7);
  EXPECT_EQ(row.phase, "stand, \"still\"");
  EXPECT_EQ(results->header.sweep.vary(0).steps(), 4);
  EXPECT_EQ(HeaderProblem(header_, results->header), "");
}

TEST_F(SweepResultsTest, NothingYetIsNoSweep) {
  EXPECT_FALSE(ReadResults(folder_));
  SetText("");
  EXPECT_FALSE(ReadResults(folder_));
  SetText("{\"poise_sw");  // killed as it began
  EXPECT_FALSE(ReadResults(folder_));
}

// Cut at every byte, it holds the runs whose lines are whole, and goes on from there to the same
// file.
TEST_F(SweepResultsTest, AHalfWrittenLineIsDropped) {
  WriteRows(2);
  const std::string whole = Text();
  const size_t header_end = whole.find('\n') + 1;
  for (size_t size = header_end; size <= whole.size(); ++size) {
    SetText(whole.substr(0, size));
    const std::optional<SweepResults> found = ReadResults(folder_);
    ASSERT_TRUE(found);
    const auto lines = std::count(whole.begin(), whole.begin() + static_cast<long>(size), '\n');
    ASSERT_EQ(found->rows.size(), static_cast<size_t>(lines - 1)) << size;
    {
      SweepResultsWriter writer(folder_, header_, found);
      for (int64_t run = 0; run < 2; ++run) {
        if (!found->rows.contains({run, 0})) writer.Append(Row(run, static_cast<double>(run) / 7));
      }
    }
    ASSERT_EQ(Text(), whole) << size;
  }
}

TEST_F(SweepResultsTest, NamesTheLineThatIsNone) {
  WriteRows(2);
  const std::string whole = Text();
  SetText(whole + "nonsense\n");
  EXPECT_NE(Problem().find("results.jsonl:4"), std::string::npos) << Problem();
  SetText(whole + "{\"run\": \"x\"}\n");
  EXPECT_NE(Problem().find("results.jsonl:4"), std::string::npos) << Problem();
  SetText("[1]\n" + whole);
  EXPECT_NE(Problem().find("results.jsonl:1"), std::string::npos) << Problem();
  std::string other = SweepRow::RowText(Row(1, 5));
  SetText(whole + other + "\n");
  EXPECT_NE(Problem().find("run 1"), std::string::npos) << Problem();
  SetText(whole + SweepRow::RowText(Row(1, 1.0 / 7)) + "\n");  // the same again
  EXPECT_EQ(Problem(), "");
}

TEST_F(SweepResultsTest, OtherSweepsAreRefused) {
  SweepHeader other = header_;
  other.digest = "e";
  EXPECT_NE(HeaderProblem(header_, other).find("another sweep"), std::string::npos);
  other = header_;
  other.program = "q";
  EXPECT_NE(HeaderProblem(header_, other).find("another build"), std::string::npos);
  other = header_;
  other.kind = kKindLimit;
  EXPECT_NE(HeaderProblem(header_, other).find("poise limit"), std::string::npos);
}

TEST(FormatOutcomes, TellsWhatWarningsWereWorth) {
  SweepHeader header;
  header.columns = {"step_needed_time", "step_warning_time"};
  SweepRows rows;
  const auto add = [&](const char* outcome, double needed, std::optional<double> warning) {
    SweepRow row;
    row.run = static_cast<int64_t>(rows.size());
    row.outcome = outcome;
    row.metrics["step_needed_time"] = needed;
    if (warning) row.metrics["step_warning_time"] = *warning;
    rows[{row.run, 0.0}] = row;
  };
  add("stands", 0, {});
  EXPECT_NE(FormatOutcomes(header, rows)
                .find("0 of 0 falls announced, false alarms in 0 of 1 that stand"),
            std::string::npos);
  add("stands", 0.2, {});
  add("stands", 0, {});
  add("fell", 0.9, 0.8);
  add("fell", 0.5, 0.3);
  add("fell", 0.1, 0);
  add("fell", 1.1, 0.9);
  EXPECT_NE(FormatOutcomes(header, rows)
                .find("3 of 4 falls announced, false alarms in 1 of 3 that stand, "
                      "median warning 0.80 s"),
            std::string::npos)
      << FormatOutcomes(header, rows);
  header.columns.pop_back();  // without the warnings' times nothing can be said
  EXPECT_EQ(FormatOutcomes(header, rows).find("step_needed"), std::string::npos);
  header.columns.push_back("step_warning_time");
  for (auto& [key, row] : rows) row.metrics.clear();
  EXPECT_EQ(FormatOutcomes(header, rows).find("step_needed"), std::string::npos);
}

TEST(SelectedRuns, PartsMakeTheWhole) {
  SessionOptions options;
  for (const int64_t size : {1, 7, 300, 1000}) {
    for (const int64_t parts : {1, 2, 3, 7, 16}) {
      int64_t next = 0;
      for (int64_t k = 1; k <= parts; ++k) {
        options.part = std::to_string(k) + "/" + std::to_string(parts);
        const auto [first, end] = SelectedRuns(options, size);
        EXPECT_EQ(first, next);
        EXPECT_LE(end - first, size / parts + 1);
        next = end;
      }
      EXPECT_EQ(next, size);
    }
  }
}

TEST(SelectedRuns, RefusesWhatIsNone) {
  const auto problem = [](const std::string& range, const std::string& part) {
    SessionOptions options;
    options.range = range;
    options.part = part;
    try {
      SelectedRuns(options, 10);
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(problem("3:10", ""), "");
  for (const char* range :
       {"3", "3:3", "5:3", "-1:3", "0:11", "a:b", "3:4:5", "1:99999999999999999999"}) {
    EXPECT_NE(problem(range, "").find("--range"), std::string::npos) << range;
  }
  for (const char* part : {"0/3", "4/3", "1", "1/0", "x/y", "1/2/3"}) {
    EXPECT_NE(problem("", part).find("--part"), std::string::npos) << part;
  }
}

}  // namespace
}  // namespace poise
