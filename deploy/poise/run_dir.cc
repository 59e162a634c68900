#include "deploy/poise/run_dir.h"

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <fstream>

#include "components/framework/configuration.h"
#include "deploy/poise/catalog.h"
#include "fmt/chrono.h"
#include "fmt/format.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFiles[] = {"run.lcm", "summary.json", "recorder.json", "run_spec.pbtxt",
                                  "scenario.pbtxt", "report.html"};

/// Keeps other runs out of `dir` until this program ends; its children do not inherit the lock.
void Lock(const fs::path& dir) {
  const int fd = open(dir.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0 || flock(fd, LOCK_EX | LOCK_NB) != 0) {
    throw ConfigError(fmt::format(
        "{}: {}", dir.string(),
        errno == EWOULDBLOCK
            ? "a run is going on in this folder; choose another with --out, or wait for its end"
            : fmt::format("cannot be locked: {}", std::strerror(errno))));
  }
}

}  // namespace

fs::path RunsDir() { return DeployDir().parent_path() / "runs"; }

fs::path MakeRunDir(const std::string& out, const std::string& name) {
  std::error_code error;
  if (!out.empty()) {
    const fs::path dir = fs::absolute(out);
    fs::create_directories(dir, error);
    if (error || !fs::is_directory(dir)) {
      throw ConfigError(fmt::format("--out {}: cannot be made: {}", out,
                                    error ? error.message() : "there is a file of that name"));
    }
    Lock(dir);
    for (const char* file : kFiles) {
      fs::remove(dir / file, error);
      fs::remove(ReferenceDir(dir) / file, error);
    }
    fs::remove(ReferenceDir(dir), error);  // if it is empty
    return dir;
  }
  const std::string dated =
      fmt::format("{:%Y-%m-%d-%H%M%S}-{}", fmt::localtime(std::time(nullptr)), name);
  fs::create_directories(RunsDir(), error);
  for (int i = 1; i < 1000 && !error; ++i) {
    const fs::path dir = RunsDir() / (i == 1 ? dated : fmt::format("{}-{}", dated, i));
    if (!fs::create_directory(dir, error)) continue;
    Lock(dir);
    PointLatestTo(dir);
    return dir;
  }
  throw ConfigError(fmt::format("{}: cannot be made: {}; choose another folder with --out",
                                (RunsDir() / dated).string(), error.message()));
}

fs::path ReferenceDir(const fs::path& dir) { return dir / "reference"; }

void PointLatestTo(const fs::path& dir) {
  const fs::path target = dir.lexically_relative(RunsDir());
  if (target.empty() || *target.begin() == "..") return;
  std::error_code error;  // a convenience: a run is good without it
  fs::remove(RunsDir() / "latest", error);
  fs::create_directory_symlink(target, RunsDir() / "latest", error);
}

fs::path FindLog(const std::string& run) {
  fs::path path = run.empty() ? RunsDir() / "latest" : fs::path(run);
  if (fs::is_directory(path)) path /= "run.lcm";
  if (!fs::exists(path)) {
    throw ConfigError(run.empty() ? "there is no run yet; start one with poise run"
                                  : fmt::format("{}: no such log or run folder", run));
  }
  return path;
}

RunSpec ReadRunSpec(const std::string& run) {
  const fs::path path = FindLog(run).parent_path() / "run_spec.pbtxt";
  RunSpec spec;
  ReadTextProto(path.string(), &spec);
  return spec;
}

void WriteFile(const fs::path& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  if (!out.flush()) throw ConfigError(fmt::format("{}: cannot be written", path.string()));
}

}  // namespace poise
