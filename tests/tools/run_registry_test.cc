#include "tools/run/run_registry.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "google/protobuf/text_format.h"
#include "tests/logging/log_test_support.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

/// A registry and runs of its own.
class RunRegistryTest : public ::testing::Test {
 protected:
  RunRegistryTest() {
    setenv("POISE_RUNTIME_DIR", registry.c_str(), 1);
    setenv("POISE_RUNS_DIR", folder.path("runs").c_str(), 1);
  }
  ~RunRegistryTest() override {
    unsetenv("POISE_RUNTIME_DIR");
    unsetenv("POISE_RUNS_DIR");
  }

  /// A run's folder.
  fs::path Run(const std::string& name, int port = 20000) {
    const fs::path dir = folder.path(name);
    fs::create_directories(dir);
    RunSpec spec = logging::MakeTestSpec();
    spec.set_first_port(port);
    spec.mutable_resource(0)->set_file("robots/dyros_legs.pbtxt");
    std::string text;
    google::protobuf::TextFormat::PrintToString(spec, &text);
    std::ofstream(dir / "run_spec.pbtxt") << text;
    return fs::canonical(dir);
  }
  int Entries() const {
    int count = 0;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(registry, error)) {
      count += entry.path().filename().string().starts_with("run-") ? 1 : 0;
    }
    return count;
  }
  static std::string ErrorOfOnlyRun() {
    try {
      OnlyRunningRun("poise log info", "poise push --run");
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }

  logging::TemporaryFolder folder;
  std::string registry = folder.path("registry");
};

TEST_F(RunRegistryTest, ARunIsThereForAsLongAsItLives) {
  EXPECT_TRUE(RunningRuns().empty());
  EXPECT_EQ(ErrorOfOnlyRun(), "no run is going on; start one with poise run");
  const fs::path dir = Run("a");
  {
    const RunRegistration registration(dir);
    const std::vector<RunningRun> runs = RunningRuns();
    ASSERT_EQ(runs.size(), 1u);
    EXPECT_EQ(runs[0].dir, dir);
    EXPECT_TRUE(runs[0].own && runs[0].readable && runs[0].networked);
    EXPECT_EQ(runs[0].scenario, "synthetic");
    EXPECT_EQ(runs[0].run_id, 42);
    EXPECT_EQ(OnlyRunningRun("", "").dir, dir);
    EXPECT_TRUE(LatestEndedRun().empty());
  }
  EXPECT_TRUE(RunningRuns().empty());
  EXPECT_EQ(LatestEndedRun(), dir);
  EXPECT_EQ(ErrorOfOnlyRun(),
            "no run is going on; the latest has ended: poise log info " + dir.string());
  fs::remove_all(dir);
  EXPECT_TRUE(LatestEndedRun().empty());
}

TEST_F(RunRegistryTest, OfSeveralRunsOneMustBeNamed) {
  const fs::path a = Run("a");
  const fs::path b = Run("b");
  const fs::path inside = Run("inside", 0);
  const RunRegistration first(a);
  const RunRegistration in_process(inside);
  EXPECT_EQ(OnlyRunningRun("", "").dir, a);  // the only one that can be heard
  const RunRegistration second(b);
  EXPECT_EQ(RunningRuns().size(), 3u);
  const std::string error = ErrorOfOnlyRun();
  EXPECT_TRUE(error.starts_with("several runs are going on; name one:\n")) << error;
  for (const fs::path& run : {a, b}) {
    EXPECT_THAT(error, ContainsRegex("  " + run.string() +
                                     "  \\(synthetic, robot dyros_legs, since "
                                     "[0-9][0-9]:[0-9][0-9]:[0-9][0-9], for [0-9]+ s\\)\n"));
  }
  EXPECT_THAT(error, ContainsRegex("\nas in: poise push --run [ab]$"));
}

TEST_F(RunRegistryTest, ARunIsNamedByFolderScenarioOrNumber) {
  const fs::path a = Run("a"), b = Run("b"), other = Run("deeper/a");
  const RunRegistration first(a), second(b);
  EXPECT_THAT(RunsNamed("b"), ElementsAre(b));
  EXPECT_EQ(RunNamed("b", "poise top"), b);
  EXPECT_THAT(RunsNamed("synthetic"), UnorderedElementsAre(a, b));
  EXPECT_THAT(RunsNamed("42"), UnorderedElementsAre(a, b));
  EXPECT_THAT(RunsNamed(other.string()), ElementsAre(other));  // which does not go on
  EXPECT_THROW(RunsNamed("nothing"), ConfigError);
  EXPECT_THROW(RunsNamed(folder.path("nothing/a")), ConfigError);  // a path, and no name
  const auto problem_of = [](const std::string& name) -> std::string {
    try {
      RunNamed(name, "poise top");
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(problem_of("nothing"), HasSubstr("no run that goes on is called so"));
  EXPECT_THAT(problem_of("synthetic"), ContainsRegex("'synthetic'; name one:\n(.*\n){2}as in: "
                                                     "poise top [ab]$"));
  // The folder's last part is the same: the whole of it tells them apart.
  const RunRegistration third(other);
  EXPECT_THAT(problem_of("a"), ContainsRegex("as in: poise top /.*a$"));
}

TEST_F(RunRegistryTest, AnEntryOfARunThatWasKilledGoes) {
  const fs::path dir = Run("a");
  const pid_t child = fork();
  if (child == 0) {
    const RunRegistration registration(dir);
    _exit(0);  // as kill -9: nothing is tidied up
  }
  waitpid(child, nullptr, 0);
  EXPECT_EQ(Entries(), 1);
  EXPECT_TRUE(RunningRuns().empty());
  EXPECT_EQ(Entries(), 0);
  EXPECT_EQ(LatestEndedRun(), dir);
}

// Whoever is root must not stop or push another person's robot without naming its run.
TEST_F(RunRegistryTest, AnotherUsersRunIsNotRootsOwn) {
  if (geteuid() != 0) GTEST_SKIP() << "takes root, to start a run as another user";
  constexpr uid_t kOther = 65'533;
  unsetenv("POISE_RUNTIME_DIR");
  const fs::path dir = Run("theirs");
  fs::permissions(folder.path(""), fs::perms::others_all, fs::perm_options::add);
  int ready[2], end[2];
  ASSERT_EQ(pipe(ready), 0);
  ASSERT_EQ(pipe(end), 0);
  const pid_t child = fork();
  if (child == 0) {
    close(end[1]);
    if (setuid(kOther) != 0) _exit(1);
    {
      const RunRegistration registration(dir);
      char byte = 1;
      if (write(ready[1], &byte, 1) != 1) _exit(1);
      byte = static_cast<char>(read(end[0], &byte, 1));  // until the parent has looked
    }
    _exit(0);
  }
  close(ready[1]);
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  const std::vector<RunningRun> runs = RunningRuns();
  const auto theirs = std::ranges::find(runs, dir, &RunningRun::dir);
  close(end[1]);
  waitpid(child, nullptr, 0);
  fs::remove_all(fmt::format("/tmp/poise-{}", kOther));
  ASSERT_NE(theirs, runs.end());
  EXPECT_FALSE(theirs->own);
  EXPECT_THAT(FormatRun(*theirs), HasSubstr(", of user 65533"));
}

TEST_F(RunRegistryTest, OddFilesAreNoRuns) {
  const RunRegistration registration(Run("a"));
  std::ofstream(registry + "/run-1-notes") << std::string(100'000, 'x');
  std::ofstream(registry + "/other") << "mine";
  fs::create_symlink("/dev/zero", registry + "/run-2-zero");
  fs::create_directory(registry + "/run-3-folder");
  ASSERT_EQ(mkfifo((registry + "/run-4-pipe").c_str(), 0600), 0);
  EXPECT_EQ(RunningRuns().size(), 1u);
  EXPECT_TRUE(fs::exists(registry + "/other"));
}

TEST_F(RunRegistryTest, ARunWithoutItsFilesIsStillNamed) {
  const fs::path dir = Run("a");
  const RunRegistration registration(dir);
  fs::remove(dir / "run_spec.pbtxt");
  const std::vector<RunningRun> runs = RunningRuns();
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_FALSE(runs[0].readable);
}

TEST_F(RunRegistryTest, ARegistryThatCannotBeWrittenFailsNoRun) {
  std::ofstream(registry) << "a file";
  testing::internal::CaptureStderr();
  { const RunRegistration registration(Run("a")); }
  const std::string warning = testing::internal::GetCapturedStderr();
  EXPECT_NE(warning.find("warning: this run cannot be registered"), std::string::npos) << warning;
  EXPECT_TRUE(RunningRuns().empty());
  EXPECT_TRUE(LatestEndedRun().empty());
}

TEST_F(RunRegistryTest, FoldersAreThoseOfThisUserAlone) {
  unsetenv("POISE_RUNTIME_DIR");
  const char* const before = std::getenv("XDG_RUNTIME_DIR");
  const std::string saved = before != nullptr ? before : "";
  const auto first_with = [](const std::string& xdg) {
    setenv("XDG_RUNTIME_DIR", xdg.c_str(), 1);
    return RegistryDirs().front();
  };
  EXPECT_EQ(first_with(folder.path("")), fs::path(folder.path("")) / "poise");
  EXPECT_NE(first_with("/nowhere"), "/nowhere/poise");
  EXPECT_NE(first_with("."), "./poise");  // which the specification tells to ignore
  fs::create_directory_symlink(folder.path(""), folder.path("link"));
  EXPECT_NE(first_with(folder.path("link")), fs::path(folder.path("link")) / "poise");
  EXPECT_EQ(RegistryDirs().back(), "/tmp/poise-" + std::to_string(geteuid()));
  before != nullptr ? setenv("XDG_RUNTIME_DIR", saved.c_str(), 1) : unsetenv("XDG_RUNTIME_DIR");
}

}  // namespace
}  // namespace poise
