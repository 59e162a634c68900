#include "tools/run/run_registry.h"

#include <fcntl.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "components/framework/configuration/configuration.h"
#include "components/framework/graph.pb.h"
#include "fmt/chrono.h"
#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_place.h"
#include "tools/run/live_run.h"
#include "tools/run/run_dir.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr char kDirPrefix[] = "poise-";  // then the user's number
constexpr char kRunPrefix[] = "run-";    // then the process's number and a random text
constexpr char kNewPrefix[] = ".new-";   // until it is locked and whole
constexpr char kEnded[] = "ended";
constexpr double kMinute = 60;  // s
constexpr double kDay = 24 * 60 * kMinute;
constexpr size_t kLongestPath = 1 << 16;

fs::path SharedDir(uid_t user) { return fmt::format("/tmp/{}{}", kDirPrefix, user); }

/// True for a folder, not a link, that belongs to `user`: nobody else has put it there.
bool BelongsTo(const fs::path& dir, uid_t user) {
  struct stat status {};
  return lstat(dir.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == user;
}

std::string ReadAll(int fd) {
  std::string text(kLongestPath, '\0');
  const ssize_t size = pread(fd, text.data(), text.size(), 0);
  text.resize(size > 0 ? static_cast<size_t>(size) : 0);
  return text;
}

/// True while another process holds the entry's lock.
bool Held(int fd) { return flock(fd, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK; }

std::string UserName(uid_t user) {
  const passwd* const entry = getpwuid(user);
  return entry != nullptr ? entry->pw_name : fmt::format("{}", user);
}

/// What the run's folder says of it.
void Describe(RunningRun* run) {
  try {
    const RunSpec spec = ReadRunSpec(run->dir.string());
    run->scenario = spec.scenario();
    run->run_id = spec.run_id();
    run->networked = spec.first_port() != 0;
    run->robot = RobotNameOf(spec);
  } catch (const ConfigError&) {
    run->readable = false;
  }
}

double AgeOf(const struct stat& status) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(now).count() - static_cast<double>(status.st_mtim.tv_sec) -
         1e-9 * static_cast<double>(status.st_mtim.tv_nsec);
}

/// The entry of a run that has died becomes that of the latest that ended, or goes.
void Retire(const fs::path& file, const struct stat& status) {
  const fs::path ended = file.parent_path() / kEnded;
  struct stat before {};
  const bool newer =
      lstat(ended.c_str(), &before) != 0 || before.st_mtim.tv_sec <= status.st_mtim.tv_sec;
  if (!newer || rename(file.c_str(), ended.c_str()) != 0) unlink(file.c_str());
}

/// Adds the run in `dir` unless it is among them. `status` is that of a file or folder which belongs
/// to the run's user and whose time is the run's start.
void AddRun(const fs::path& dir, const struct stat& status, std::vector<RunningRun>* runs) {
  const auto known = [&](const RunningRun& other) { return other.dir == dir; };
  if (dir.empty() || std::ranges::any_of(*runs, known)) return;
  RunningRun run;
  run.dir = dir;
  run.user = UserName(status.st_uid);
  run.own = status.st_uid == geteuid();
  run.start = status.st_mtim.tv_sec;
  run.age = AgeOf(status);
  Describe(&run);
  runs->push_back(std::move(run));
}

/// Adds the runs that are registered in a folder of `user`'s.
void AddRuns(const fs::path& dir, uid_t user, std::vector<RunningRun>* runs) {
  if (!BelongsTo(dir, user)) return;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(dir, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kRunPrefix) && !name.starts_with(kNewPrefix)) continue;
    const FileDescriptor fd(
        open(entry.path().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    struct stat status {};
    if (fd < 0 || fstat(fd, &status) != 0 || !S_ISREG(status.st_mode) || status.st_uid != user) {
      continue;
    }
    if (name.starts_with(kNewPrefix)) {
      // A run was killed as it registered.
      if (user == geteuid() && AgeOf(status) > kMinute) unlink(entry.path().c_str());
      continue;
    }
    if (Held(fd)) {
      AddRun(ReadAll(fd), status, runs);
    } else if (user == geteuid()) {
      Retire(entry.path(), status);
    }
  }
}

/// Folders of /tmp in which other users' runs may be registered, with the users.
std::vector<std::pair<fs::path, uid_t>> OtherUsersDirs() {
  std::vector<std::pair<fs::path, uid_t>> dirs;
  if (std::getenv("POISE_RUNTIME_DIR") != nullptr) return dirs;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/tmp", error)) {
    if (!entry.path().filename().string().starts_with(kDirPrefix)) continue;
    struct stat status {};
    if (lstat(entry.path().c_str(), &status) != 0 || status.st_uid == geteuid()) continue;
    if (entry.path() == SharedDir(status.st_uid)) dirs.emplace_back(entry.path(), status.st_uid);
  }
  return dirs;
}

}  // namespace

std::vector<fs::path> RegistryDirs() {
  if (const char* const dir = std::getenv("POISE_RUNTIME_DIR"); dir != nullptr && *dir != '\0') {
    return {dir};
  }
  std::vector<fs::path> dirs;
  // `sudo -E` and `su` leave another user's folder in the environment: it is passed over.
  const auto add = [&](const fs::path& own) {
    if (!own.is_absolute() || !BelongsTo(own, geteuid())) return;
    const fs::path dir = own / "poise";
    if (!IsAmong(dir, dirs)) dirs.push_back(dir);
  };
  if (const char* const xdg = std::getenv("XDG_RUNTIME_DIR"); xdg != nullptr) add(xdg);
  // It counts also when the environment does not tell it, as under cron.
  add(fmt::format("/run/user/{}", geteuid()));
  dirs.push_back(SharedDir(geteuid()));
  return dirs;
}

RunRegistration::RunRegistration(const fs::path& run_dir) {
  std::error_code error;
  fs::path dir = fs::canonical(run_dir, error);
  if (error) dir = fs::absolute(run_dir);
  for (const fs::path& registry : RegistryDirs()) {
    // Others may look, to find a run that another user started.
    if (mkdir(registry.c_str(), 0755) != 0 && errno != EEXIST) continue;
    if (!BelongsTo(registry, geteuid())) continue;
    // Locked before it has its name, so that nobody takes it for a run that has died.
    std::string file = (registry / kNewPrefix).string() + "XXXXXX";
    FileDescriptor fd(mkostemp(file.data(), O_CLOEXEC));
    if (fd < 0) continue;
    const fs::path name =
        registry / fmt::format("{}{}-{}", kRunPrefix, getpid(), file.substr(file.size() - 6));
    if (flock(fd, LOCK_EX | LOCK_NB) != 0 || fchmod(fd, 0644) != 0 || !WriteAll(fd, dir.native()) ||
        rename(file.c_str(), name.c_str()) != 0) {
      unlink(file.c_str());
      continue;
    }
    entries_.push_back({name, std::move(fd)});
  }
  if (entries_.empty()) {
    fmt::print(stderr,
               "warning: this run cannot be registered in {}; poise estop, top, echo and view need "
               "its folder: {}\n",
               RegistryDirs().back().string(), logging::ForTerminal(dir.string()));
  }
}

RunRegistration::~RunRegistration() {
  for (const Entry& entry : entries_) {
    futimens(entry.fd, nullptr);  // when it ended
    const fs::path ended = entry.file.parent_path() / kEnded;
    if (rename(entry.file.c_str(), ended.c_str()) != 0) unlink(entry.file.c_str());
  }
}

std::vector<RunningRun> RunningRuns() {
  std::vector<RunningRun> runs;
  for (const fs::path& dir : RegistryDirs()) AddRuns(dir, geteuid(), &runs);
  for (const auto& [dir, user] : OtherUsersDirs()) AddRuns(dir, user, &runs);
  std::error_code error;
  const fs::path latest = fs::canonical(RunsDir() / "latest", error);
  struct stat status {};
  if (!error && RunInProgress(latest) && stat(latest.c_str(), &status) == 0) {
    AddRun(latest, status, &runs);
  }
  std::ranges::sort(runs, [](const RunningRun& a, const RunningRun& b) { return a.age < b.age; });
  return runs;
}

fs::path LatestEndedRun() {
  fs::path newest;
  double least = 0;
  std::error_code error;
  const auto take = [&](const fs::path& dir, double age) {
    if (!fs::is_regular_file(dir / kSpecFile, error)) return;
    if (!newest.empty() && age >= least) return;
    newest = dir;
    least = age;
  };
  for (const fs::path& dir : RegistryDirs()) {
    const FileDescriptor fd(
        open((dir / kEnded).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    struct stat status {};
    if (fd < 0 || fstat(fd, &status) != 0 || status.st_uid != geteuid()) continue;
    take(ReadAll(fd), AgeOf(status));
  }
  if (!newest.empty()) return newest;
  const fs::path latest = fs::canonical(RunsDir() / "latest", error);
  if (!error) take(latest, 0);
  return newest;
}

std::string FormatRun(const RunningRun& run) {
  std::string what = "its folder cannot be read from here";
  if (run.readable) {
    what = run.scenario;
    if (!run.robot.empty()) what += ", robot " + run.robot;
    if (!run.networked) what += ", inside one process";
  }
  if (run.user != UserName(geteuid())) what += ", of user " + run.user;
  const double age = std::max(run.age, 0.0);
  const std::string since = age < kDay
                                ? fmt::format("{:%H:%M:%S}", fmt::localtime(run.start))
                                : fmt::format("{:%Y-%m-%d %H:%M}", fmt::localtime(run.start));
  const std::string lasts =
      age < 10 * kMinute ? fmt::format("{:.0f} s", age) : fmt::format("{:.0f} min", age / kMinute);
  return fmt::format("{}  ({}, since {}, for {})", logging::ForTerminal(run.dir.string()),
                     logging::ForTerminal(what), since, lasts);
}

std::string FormatRuns(const std::vector<RunningRun>& runs) {
  std::string text;
  for (const RunningRun& run : runs) text += "  " + FormatRun(run) + "\n";
  return text;
}

namespace {

/// A list of which one has to be named, and how.
ConfigError NameOne(std::string_view problem, const std::vector<RunningRun>& runs,
                    std::string_view command) {
  const fs::path name = runs.front().dir.filename();
  const auto namesakes = std::ranges::count_if(
      runs, [&](const RunningRun& run) { return run.dir.filename() == name; });
  const fs::path& example = namesakes == 1 ? name : runs.front().dir;
  return ConfigError(fmt::format("{}:\n{}as in: {} {}", problem, FormatRuns(runs), command,
                                 logging::ForTerminal(example.string())));
}

bool IsCalled(const RunningRun& run, const std::string& name) {
  return run.dir.filename() == name || run.scenario == name || std::to_string(run.run_id) == name;
}

}  // namespace

RunningRun OnlyRunningRun(std::string_view log_command, std::string_view command) {
  const std::vector<RunningRun> runs = RunningRuns();
  std::vector<RunningRun> own;
  std::ranges::copy_if(runs, std::back_inserter(own), &RunningRun::own);
  std::vector<RunningRun> heard;
  std::ranges::copy_if(own, std::back_inserter(heard), &RunningRun::networked);
  if (heard.size() == 1) return heard.front();
  if (heard.empty() && own.size() == 1) return own.front();  // the caller tells what it lacks
  if (!own.empty()) {
    throw NameOne("several runs are going on; name one", heard.empty() ? own : heard, command);
  }
  if (!runs.empty()) {
    throw NameOne("no run of yours is going on; name another user's", runs, command);
  }
  const fs::path ended = log_command.empty() ? fs::path() : LatestEndedRun();
  throw ConfigError(ended.empty() ? "no run is going on; start one with poise run"
                                  : fmt::format("no run is going on; the latest has ended: {} {}",
                                                log_command, logging::ForTerminal(ended.string())));
}

std::vector<fs::path> RunsNamed(const std::string& name) {
  const fs::path path = name;
  if (RunInProgress(path)) return {path};
  std::vector<RunningRun> runs;
  if (path.filename() == path) runs = RunningRuns();
  std::vector<fs::path> called;
  for (const bool own : {true, false}) {
    for (const RunningRun& run : runs) {
      if (run.own == own && IsCalled(run, name)) called.push_back(run.dir);
    }
    if (!called.empty()) return called;
  }
  std::error_code error;
  if (fs::exists(path, error)) return {path};
  throw ConfigError(
      fmt::format("{}: no such run folder, and no run that goes on is called so; "
                  "poise list runs shows those",
                  logging::ForTerminal(name)));
}

fs::path RunNamed(const std::string& name, std::string_view command) {
  const std::vector<fs::path> dirs = RunsNamed(name);
  if (dirs.size() == 1) return dirs.front();
  std::vector<RunningRun> runs = RunningRuns();
  std::erase_if(runs, [&](const RunningRun& run) { return !IsAmong(run.dir, dirs); });
  // They may have ended meanwhile.
  if (runs.empty()) throw ConfigError(fmt::format("{}: this run has ended", dirs.front().string()));
  throw NameOne(fmt::format("several runs are called '{}'; name one", logging::ForTerminal(name)),
                runs, command);
}

}  // namespace poise
