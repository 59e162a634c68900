// What a person sees of a run: two sentences, a table that fits, the verdict; on every terminal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/graph/poise_program.h"

namespace poise {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A variable of the environment that poise sees, as long as this lives; nullptr: unset.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) {
    const char* const before = std::getenv(name);
    if (before != nullptr) before_ = before;
    had_ = before != nullptr;
    value == nullptr ? unsetenv(name) : setenv(name, value, 1);
  }
  ~Environment() { had_ ? setenv(name_, before_.c_str(), 1) : unsetenv(name_); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* name_;
  std::string before_;
  bool had_ = false;
};

size_t Columns(const std::string& line) {
  return static_cast<size_t>(std::count_if(line.begin(), line.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  }));
}

/// A line that is wider is a command or an address with a path, which are not broken.
void ExpectFits(const std::string& text, size_t width) {
  for (const std::string& line : Lines(text)) {
    if (Columns(line) <= width) continue;
    EXPECT_THAT(line, HasSubstr("/")) << "of " << width << " columns";
  }
}

/// With its line breaks as spaces.
std::string Flat(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

class FirstScreenTest : public testing::Test {
 protected:
  FirstScreenTest() {
    deploy_.Scenario(
        "pushed",
        "base: \"base/stand\" name: \"pushed\" paper_section: \"7.2\" duration: 0.5\n"
        "description: \"Standing on both feet, and pushed a little while nobody looks at it\"\n"
        "check { metric: \"push_peak\" label: \"push, largest\" at_most: 70 paper: \"60 N\""
        "        paper_value: 60 }\n"
        "check { metric: \"com_error_max_y\" label: \"COM error, lateral, largest of all\""
        "        at_most: 45 paper: \"35 mm, which is a long text for a table's cell\" }\n"
        "check { metric: \"joint_torque_max\" label: \"joint torque\" }\n"
        "assumption { field: \"duration\" kind: \"assumed\" reason: \"for this test\" }\n");
  }

  TestDeploy deploy_;
  std::string run_ = deploy_ / "run";
};

TEST_F(FirstScreenTest, TellsWhatHappenedInTheTerminalsWidth) {
  const Environment locale("LC_ALL", "C.UTF-8");
  const ProgramResult run = RunPoise({"run", "pushed", "--inline", "--out", run_});
  ASSERT_EQ(run.exit_code, 0) << run.output;
  ExpectFits(run.output, 80);
  EXPECT_THAT(Flat(run.output), HasSubstr("engine ode: contact_erp 0.2, contact_cfm 1e-07, solver "
                                          "TREE, step 0.001 s,"));
  EXPECT_THAT(Flat(run.output), HasSubstr("ground friction 0.9"));
  // The figures are the summary's.
  const nlohmann::json summary = ReadSummary(run_);
  double peak = 0;
  int limited = 0;
  for (const nlohmann::json& check : summary["checks"]) {
    if (check["name"] == "push_peak") peak = check["measured"].get<double>();
    limited += check["limit"].is_null() ? 0 : 1;
  }
  char text[100];
  std::snprintf(text, sizeof text, " with up to %.1f N, at ", peak);
  EXPECT_THAT(run.output, HasSubstr("\nPushed from "));
  EXPECT_THAT(Flat(run.output), HasSubstr(text));
  EXPECT_THAT(Flat(run.output), HasSubstr("the robot stood"));
  std::snprintf(text, sizeof text, "passed: %d of %d checks hold, 2 of them above\n", limited,
                limited);
  EXPECT_THAT(run.output, HasSubstr(text));
  // The paper's rows alone; all with --full.
  EXPECT_THAT(run.output, HasSubstr("\npush, largest"));
  EXPECT_THAT(run.output, Not(HasSubstr("\njoint torque")));
  EXPECT_THAT(run.output, Not(HasSubstr("for this test")));
  // The page is not there yet: its address comes with it.
  EXPECT_THAT(run.output, Not(HasSubstr("file://")));
  EXPECT_THAT(RunPoise({"report", run_}).output, HasSubstr("file://" + run_ + "/report.html"));
  std::snprintf(text, sizeof text, "all %d checks with their limits", limited);
  EXPECT_THAT(Flat(run.output), HasSubstr(text));
  const ProgramResult full = RunPoise({"report", run_, "--no-html", "--full"});
  EXPECT_THAT(full.output, HasSubstr("\njoint torque"));
  EXPECT_THAT(Flat(full.output), HasSubstr("engine ode: contact_erp 0.2"));
  EXPECT_THAT(full.output, HasSubstr("duration = 0.5: for this test"));
  EXPECT_THAT(full.output, HasSubstr("push ends"));
  for (const char* width : {"80", "60", "40"}) {
    const Environment columns("COLUMNS", width);
    for (const char* flag : {"--no-html", "--full"}) {
      const ProgramResult report = RunPoise({"report", run_, flag});
      EXPECT_EQ(report.exit_code, 0) << report.output;
      ExpectFits(report.output, static_cast<size_t>(std::atoi(width)));
    }
  }
  for (const char* width : {"80", "60"}) {
    const Environment columns("COLUMNS", width);
    ExpectFits(RunPoise({"list", "metrics"}).output, static_cast<size_t>(std::atoi(width)));
    ExpectFits(RunPoise({"run", "--help"}).output, static_cast<size_t>(std::atoi(width)));
  }
}

TEST_F(FirstScreenTest, PointsToAMatrixOfThisVeryRunOrToNone) {
  const auto hint = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--inline", "--force", "--out", run_});
    const ProgramResult run = RunPoise(arguments);
    for (const std::string& line : Lines(run.output)) {
      if (line.find(" matrix ") != std::string::npos) return line.substr(line.find("matrix "));
    }
    return std::string();
  };
  EXPECT_EQ(hint({"run", "pushed"}), "matrix pushed");
  // A file of the user's own that is called as an installed scenario is: the file is meant.
  const std::string file = deploy_ / "my own.pbtxt";
  std::ofstream(file) << "base: \"base/stand\" name: \"pushed\" duration: 0.5\n";
  EXPECT_EQ(hint({"run", file}), "matrix '" + file + "'");
  EXPECT_EQ(hint({"run", "pushed", "--set", "sim.push[0].peak=50"}), "");
  EXPECT_EQ(hint({"run", "pushed", "--duration", "0.4"}), "");
  EXPECT_EQ(hint({"run", "pushed", "--ideal"}), "");
}

TEST_F(FirstScreenTest, TellsOfAFallWhenAndWhatWentWrongBefore) {
  const ProgramResult run =
      RunPoise({"run", "pushed", "--inline", "--out", run_, "--duration", "4", "--set",
                "sim.push[0].peak=1000", "--set", "sim.push[0].duration=0.2"});
  EXPECT_EQ(run.exit_code, 1) << run.output;
  const nlohmann::json summary = ReadSummary(run_);
  char text[100] = "";
  for (const nlohmann::json& event : summary["events"]) {
    if (event["name"] != "fall") continue;
    std::snprintf(text, sizeof text, "fell at %.3f s", event["time"].get<double>());
  }
  ASSERT_NE(text[0], '\0') << summary["events"];
  const std::string words = Flat(run.output);
  EXPECT_THAT(words, HasSubstr(std::string("the robot ") + text + " of 4 s"));
  EXPECT_THAT(words, HasSubstr("Before it fell: at "));
  EXPECT_THAT(words, HasSubstr("FAILED: sim: the robot fell"));
}

TEST_F(FirstScreenTest, QuietSaysWhatFailed) {
  const std::vector<std::string> fails = {
      "run", "pushed", "--inline", "--quiet", "--set", "check[push_peak].at_most=1", "--out", run_};
  const Environment locale("LC_ALL", "C");
  const ProgramResult run = RunPoise(fails);
  EXPECT_EQ(run.exit_code, 1) << run.output;
  ASSERT_EQ(Lines(run.output).size(), 1u) << run.output;
  EXPECT_THAT(run.output, testing::MatchesRegex("FAILED: 1 of [0-9]+: push, largest .push_peak. "
                                                "measured [0-9.]+ N, limit <= 1 N\n"));
}

TEST_F(FirstScreenTest, ShowsPlainCharactersWhereTheLocaleHasNoOthers) {
  const auto report = [&](const char* locale) {
    const Environment all("LC_ALL", locale);
    return RunPoise({"report", run_, "--no-html", "--full"}).output;
  };
  ASSERT_EQ(RunPoise({"run", "pushed", "--inline", "--quiet", "--out", run_}).exit_code, 0);
  const auto ascii = [](const std::string& text) {
    return std::all_of(text.begin(), text.end(),
                       [](char c) { return static_cast<unsigned char>(c) < 0x80; });
  };
  EXPECT_TRUE(ascii(report("C"))) << report("C");
  EXPECT_THAT(report("C"), HasSubstr("<= 70 N"));
  EXPECT_THAT(report("C.UTF-8"), HasSubstr("≤ 70 N"));
  EXPECT_THAT(report("C.UTF-8"), HasSubstr("───"));
}

/// What poise writes to a terminal of `columns`.
std::string OnTerminal(const std::vector<std::string>& arguments, unsigned short columns) {
  std::vector<std::string> copy = {POISE_BIN_DIR "/poise"};
  copy.insert(copy.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& argument : copy) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  const winsize size{24, columns, 0, 0};
  int fd = -1;
  const pid_t pid = forkpty(&fd, nullptr, nullptr, &size);
  if (pid == 0) {
    execv(pointers[0], pointers.data());
    _exit(127);
  }
  std::string output;
  char buffer[4096];
  for (ssize_t n = 0; (n = read(fd, buffer, sizeof buffer)) > 0;) {
    output.append(buffer, static_cast<size_t>(n));
  }
  close(fd);
  waitpid(pid, nullptr, 0);
  output.erase(std::remove(output.begin(), output.end(), '\r'), output.end());
  return output;
}

TEST_F(FirstScreenTest, IsColouredOnATerminalAloneAndFitsIt) {
  const Environment terminal("TERM", "xterm");
  const Environment none("NO_COLOR", nullptr);
  ASSERT_EQ(RunPoise({"run", "pushed", "--inline", "--quiet", "--out", run_}).exit_code, 0);
  const std::vector<std::string> report = {"report", run_, "--no-html"};
  EXPECT_THAT(OnTerminal(report, 80), HasSubstr("\x1b[32mok\x1b[0m"));
  EXPECT_THAT(RunPoise(report).output, Not(HasSubstr("\x1b")));
  const Environment plain("NO_COLOR", "1");
  const std::string narrow = OnTerminal(report, 50);
  EXPECT_THAT(narrow, Not(HasSubstr("\x1b")));
  ExpectFits(narrow, 50);
}

// Its person ends an interactive run: that it did not last as long as it might have is no failure,
// neither then nor when it is read again.
TEST(FirstScreen, AnInteractiveRunEndsByCtrlC) {
  RunFolder folder;
  PoiseProgram run({"run", "stand", "--interactive", "--duration", "600", "--out", folder / "run"});
  ASSERT_TRUE(WaitForLog(folder / "run", kUnderWay * 20));
  kill(run.pid(), SIGINT);
  const ProgramResult ended = run.Wait();
  EXPECT_EQ(ended.exit_code, 0) << ended.output;
  const auto in_one_line = [](std::string text) {
    std::ranges::replace(text, '\n', ' ');
    return text;
  };
  EXPECT_THAT(in_one_line(ended.output), HasSubstr("of 600 s: ended by hand"));
  EXPECT_THAT(ended.output, HasSubstr("passed: "));
  EXPECT_EQ(ReadSummary(folder / "run")["passed"], true);
  const ProgramResult report = RunPoise({"report", folder / "run", "--no-html"});
  EXPECT_EQ(report.exit_code, 0) << report.output;
  EXPECT_THAT(in_one_line(report.output), HasSubstr("of 600 s: ended by hand"));
}

TEST(CommandLine, SaysWhatWasMeant) {
  ExpectUsageError({"rnu"}, {"poise has no command 'rnu'", "did you mean run", "poise --help"});
  ExpectUsageError({"log", "inof"}, {"poise log has no command 'inof'", "info"});
  ExpectUsageError({"run", "--durration", "5"},
                   {"--durration", "did you mean --duration", "poise run --help"});
  ExpectUsageError({"report", "--seed", "5"}, {"--seed", "poise run"});
  ExpectUsageError({"compare", "a", "b", "c"}, {"'c'", "poise compare --help"});
  ExpectUsageError({"view", "--run", "a"}, {"--run", "without a flag: poise view run"});
  ExpectUsageError({"run", "--out"}, {"--out needs a value"});
  ExpectUsageError({"run", "--duration", "long"}, {"--duration", "poise run --help"});
}

TEST(CommandLine, OptionsAreDescribedInOneColumn) {
  for (const std::vector<std::string>& help :
       {std::vector<std::string>{"run", "--help"}, {"robot", "import", "--help"}}) {
    for (const std::string& line : Lines(RunPoise(help).output)) {
      const bool described = !line.ends_with("...") && !line.ends_with("}");
      if (line.starts_with("  --") && line.size() > 30 && described) {
        EXPECT_EQ(line[29], ' ') << line;
      }
    }
  }
}

TEST(CommandLine, HelpsWhereNothingWasAskedFor) {
  const ProgramResult alone = RunPoise({});
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_THAT(alone.output, HasSubstr("Usage: poise"));
  EXPECT_THAT(alone.output, HasSubstr("report"));
  EXPECT_THAT(RunPoise({"log"}).output, HasSubstr("export"));
  EXPECT_EQ(RunPoise({"help", "log"}).output, RunPoise({"log", "--help"}).output);
}

}  // namespace
}  // namespace poise
