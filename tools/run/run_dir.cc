#include "tools/run/run_dir.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "fmt/chrono.h"
#include "fmt/format.h"
#include "logging/log_sums.h"
#include "logging/printable.h"
#include "logging/run_info.h"
#include "tools/cli/output_place.h"
#include "tools/run/remake.h"
#include "tools/run/run_registry.h"
#include "tools/scenario/catalog.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFiles[] = {"run.lcm",       "run.lcm.crc32", "run.packed",  "summary.json",
                                  "recorder.json", kSpecFile,       kScenarioFile, "report.html"};

/// The folder or log that `run` means. Throws ConfigError.
fs::path FindRun(const std::string& run) {
  const fs::path path = run.empty() ? RunsDir() / "latest" : fs::path(run);
  if (!fs::exists(path)) {
    if (!run.empty()) throw ConfigError(fmt::format("{}: no such log or run folder", run));
    const fs::path ended = LatestEndedRun();  // elsewhere, or with --out
    throw ConfigError(fmt::format("there is no run in {} yet; {}", RunsDir().string(),
                                  ended.empty()
                                      ? "start one with poise run"
                                      : fmt::format("name the folder of one; the last was in {}",
                                                    logging::ForTerminal(ended.string()))));
  }
  return path;
}

/// The folder of runs where the usual one cannot be written: $XDG_STATE_HOME/poise/runs, or below
/// ~/.local/state; empty without a home.
fs::path StateRuns() {
  const char* const state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && *state == '/') return fs::path(state) / "poise" / "runs";
  const char* const home = std::getenv("HOME");
  if (home != nullptr && *home == '/') return fs::path(home) / ".local/state/poise/runs";
  return {};
}

bool Writable(const fs::path& folder) { return access(folder.c_str(), W_OK | X_OK) == 0; }

}  // namespace

fs::path RunsDir() {
  if (const char* const dir = std::getenv("POISE_RUNS_DIR"); dir != nullptr && *dir != '\0') {
    return fs::absolute(dir);
  }
  std::error_code error;
  const fs::path here = fs::current_path();
  const fs::path home = fs::canonical(DeployDir(), error).parent_path();
  const fs::path within = error ? fs::path() : here.lexically_relative(home);
  const bool inside = !within.empty() && *within.begin() != "..";
  const fs::path runs = (inside ? home : here) / "runs";
  if (const fs::path state = StateRuns();
      !state.empty() && !Writable(fs::is_directory(runs, error) ? runs : runs.parent_path())) {
    return state;
  }
  return runs;
}

RunDir::RunDir(fs::path path)
    : path_(std::move(path)), fd_(open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (fd_ >= 0 && flock(fd_, LOCK_EX | LOCK_NB) == 0) return;
  const int problem = errno;
  throw ConfigError(fmt::format(
      "{}: {}", path_.string(),
      problem == EWOULDBLOCK
          ? "a run is going on in this folder; choose another with --out, or wait for its end"
          : fmt::format("cannot be locked: {}", std::strerror(problem))));
}

RunDir MakeRunDir(const std::string& out, const std::string& name, bool force) {
  std::error_code error;
  if (!out.empty()) {
    const fs::path path = MakeOutFolder(out);
    RunDir dir(path);
    CheckFolderFree("--out", out, force);
    for (const char* file : kFiles) {
      fs::remove(path / file, error);
      fs::remove(ReferenceDir(path) / file, error);
    }
    fs::remove(ReferenceDir(path), error);  // if it is empty
    return dir;
  }
  const std::string dated =
      fmt::format("{:%Y-%m-%d-%H%M%S}-{}", fmt::localtime(std::time(nullptr)), name);
  fs::create_directories(RunsDir(), error);
  for (int i = 1; i < 1000 && !error; ++i) {
    const fs::path path = RunsDir() / (i == 1 ? dated : fmt::format("{}-{}", dated, i));
    if (fs::create_directory(path, error)) return RunDir(path);
  }
  throw ConfigError(
      fmt::format("{}: cannot be made: {}; go to a folder of your own, or name one with --out",
                  (RunsDir() / dated).string(), error.message()));
}

void WriteRunFiles(const fs::path& dir, const run_info_t& info) {
  WriteFile(dir / kSpecFile, info.run_spec);
  WriteFile(dir / kScenarioFile, info.scenario);
}

int64_t RemoveRun(const RunDir& run) {
  const fs::path& dir = run.path();
  std::vector<std::string> files(std::begin(kFiles), std::end(kFiles));
  std::vector<std::string> processes = ProcessNames(ReadRunSpec(dir.string()).graph());
  processes.insert(processes.end(), {"recorder", "ros2"});
  for (const std::string& process : processes) files.push_back(process + ".log");
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(dir, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("branch_") && name.ends_with(".lcm")) files.push_back(name);
  }
  int64_t freed = 0;
  for (const fs::path& part : {ReferenceDir(dir), dir}) {
    for (const std::string& file : files) {
      const auto size = fs::file_size(part / file, error);
      if (!error && fs::remove(part / file, error)) freed += static_cast<int64_t>(size);
    }
    fs::remove(part, error);  // if it is empty
  }
  return freed;
}

fs::path ReferenceDir(const fs::path& dir) { return dir / "reference"; }

void PointLatestTo(const fs::path& dir) {
  const fs::path target = dir.lexically_relative(RunsDir());
  if (target.empty() || *target.begin() == "..") return;
  std::error_code error;  // a convenience: a run is good without it
  // Replaced in one step: another program always finds one.
  const fs::path next = RunsDir() / fmt::format(".latest-{}", getpid());
  fs::create_directory_symlink(target, next, error);
  fs::rename(next, RunsDir() / "latest", error);
  if (error) fs::remove(next, error);
}

fs::path FindLog(const std::string& run) {
  fs::path path = FindRun(run);
  if (!fs::is_directory(path)) {
    if (!logging::IsPackedLog(path.string())) return path;
    const fs::path log = fs::path(path).replace_extension(".lcm");
    if (!fs::exists(log)) MakeLogAgain(path, log);
    return log;
  }
  path /= "run.lcm";
  const fs::path packed = path.parent_path() / "run.packed";
  if (!fs::exists(path) && fs::exists(packed)) MakeLogAgain(packed, path);
  if (!fs::exists(path)) {
    throw ConfigError(fmt::format("{}: is missing: that run has not begun, or never came to start",
                                  path.string()));
  }
  return path;
}

fs::path FindEndedLog(const std::string& run) {
  fs::path log = FindLog(run);
  const fs::path dir = fs::absolute(log).parent_path();
  const FileDescriptor fd(open(dir.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (log.filename() == "run.lcm" && fd >= 0 && flock(fd, LOCK_SH | LOCK_NB) != 0 &&
      errno == EWOULDBLOCK) {
    throw ConfigError(
        fmt::format("{}: this run still goes on: wait for its end, or look at it with poise top or "
                    "poise view",
                    dir.string()));
  }
  return log;
}

void WarnOfRunInfo(const fs::path& log) {
  const std::string warning = logging::RunInfoWarning(log.string());
  if (!warning.empty()) fmt::print(stderr, "warning: {}\n", logging::ForTerminal(warning));
  for (const std::string& problem :
       logging::CheckSums(log.string()).value_or(std::vector<std::string>{})) {
    fmt::print(stderr, "warning: {}: {}\n", logging::ForTerminal(log.string()), problem);
  }
}

RunSpec ReadRunSpec(const std::string& run) {
  fs::path path = FindRun(run);
  if (!fs::is_directory(path)) path = path.parent_path();
  path /= kSpecFile;
  RunSpec spec;
  ReadTextProto(path.string(), &spec);
  return spec;
}

std::string RobotNameOf(const RunSpec& spec) {
  return fs::path(ResourceOf(spec, "robot").file()).stem().string();
}

}  // namespace poise
