#include "tests/graph/poise_program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace poise {
namespace fs = std::filesystem;

namespace {

/// Runs of tests beside this one are not this one's: each process has a registry of its own.
class ProcessRegistry {
 public:
  ProcessRegistry()
      : folder_(fs::temp_directory_path() / ("poise_registry_" + std::to_string(getpid()))) {
    setenv("POISE_RUNTIME_DIR", folder_.c_str(), 0);
  }
  ~ProcessRegistry() {
    std::error_code error;
    fs::remove_all(folder_, error);
  }

 private:
  fs::path folder_;
};
const ProcessRegistry process_registry;

}  // namespace

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string ReadAll(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;  // an iterator would throw where a process of /proc ends meanwhile
  text << in.rdbuf();
  return text.str();
}

PoiseProgram::PoiseProgram(const std::vector<std::string>& arguments) {
  output_file_ = (fs::temp_directory_path() / "poise_output_XXXXXX").string();
  const int output = mkstemp(output_file_.data());
  if (output < 0) throw std::runtime_error("mkstemp failed");
  std::vector<std::string> copy = {POISE_BIN_DIR "/poise"};
  copy.insert(copy.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& argument : copy) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) {
    dup2(output, STDOUT_FILENO);
    dup2(output, STDERR_FILENO);
    execv(pointers[0], pointers.data());
    _exit(127);
  }
  close(output);
}

PoiseProgram::~PoiseProgram() {
  if (pid_ > 0) {
    kill(pid_, SIGTERM);
    Wait();
  }
  unlink(output_file_.c_str());
}

ProgramResult PoiseProgram::Wait() {
  int status = 0;
  const auto ended = [&] { return waitpid(pid_, &status, WNOHANG) == pid_; };
  if (!WaitUntil(ended)) {
    kill(pid_, SIGKILL);
    waitpid(pid_, &status, 0);
  }
  pid_ = -1;
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ReadAll(output_file_)};
}

ProgramResult RunPoise(const std::vector<std::string>& arguments) {
  return PoiseProgram(arguments).Wait();
}

void ExpectUsageError(const std::vector<std::string>& arguments,
                      const std::vector<std::string>& parts) {
  const ProgramResult result = RunPoise(arguments);
  EXPECT_EQ(result.exit_code, 2) << result.output;
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  EXPECT_EQ(result.output.find("poise: "), 0u) << result.output;
  for (const std::string& part : parts) {
    EXPECT_NE(result.output.find(part), std::string::npos) << part << " in " << result.output;
  }
}

RunFolder::RunFolder() {
  std::string name = (fs::temp_directory_path() / "poise_graph_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
  path_ = name;
}

RunFolder::~RunFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

TestDeploy::TestDeploy() {
  fs::create_directories(folder_ / "deploy/scenarios/base");
  for (const char* kind : {"robots", "graphs"}) {
    fs::create_directory_symlink(fs::path(POISE_SOURCE_DIR) / "deploy" / kind,
                                 fs::path(folder_ / "deploy") / kind);
  }
  fs::copy_file(StandScenario(), folder_ / "deploy/scenarios/base/stand.pbtxt");
  setenv("POISE_DEPLOY_DIR", (folder_ / "deploy").c_str(), 1);
  setenv("POISE_RUNS_DIR", runs().c_str(), 1);
}

TestDeploy::~TestDeploy() {
  unsetenv("POISE_DEPLOY_DIR");
  unsetenv("POISE_RUNS_DIR");
}

std::string TestDeploy::Scenario(const std::string& name, const std::string& text) const {
  const std::string file = folder_ / ("deploy/scenarios/" + name + ".pbtxt");
  std::ofstream(file) << text;
  return file;
}

std::vector<std::string> Experiments() {
  std::vector<std::string> names;
  for (const auto& file :
       std::filesystem::directory_iterator(std::string(POISE_SOURCE_DIR) + "/deploy/scenarios")) {
    if (file.path().extension() != ".pbtxt") continue;
    if (ReadAll(file.path()).find("\npaper_section:") == std::string::npos) continue;
    names.push_back(file.path().stem().string());
  }
  return names;
}

std::string StandScenario() { return POISE_SOURCE_DIR "/tests/graph/data/stand.pbtxt"; }

nlohmann::json ReadSummary(const std::string& run) {
  return nlohmann::json::parse(ReadAll(fs::path(run) / "summary.json"));
}

std::vector<pid_t> ProcessesWith(const std::string& text) {
  std::vector<pid_t> found;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    const pid_t pid = static_cast<pid_t>(std::strtol(name.c_str(), nullptr, 10));
    if (pid <= 0 || pid == getpid()) continue;
    if (ReadAll(entry.path() / "cmdline").find(text) != std::string::npos) found.push_back(pid);
  }
  return found;
}

pid_t ComponentProcess(const std::string& run, const std::string& component) {
  for (const pid_t pid : ProcessesWith(run)) {
    std::string name = ReadAll(fs::path("/proc") / std::to_string(pid) / "cmdline");
    name = fs::path(name.substr(0, name.find('\0'))).filename().string();
    if (name == component) return pid;
  }
  return -1;
}

bool WaitForLog(const std::string& run, uintmax_t size) {
  return WaitUntil([&] {
    std::error_code error;
    const uintmax_t now = fs::file_size(fs::path(run) / "run.lcm", error);
    return !error && now >= size;
  });
}

std::vector<CsvRow> ReadCsv(const std::string& file) {
  std::ifstream in(file);
  std::vector<std::vector<std::string>> lines(1, std::vector<std::string>(1));
  bool quoted = false;
  for (char c = 0; in.get(c);) {
    if (quoted && c == '"' && in.peek() == '"') {
      lines.back().back() += static_cast<char>(in.get());
    } else if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && c == ',') {
      lines.back().emplace_back();
    } else if (!quoted && c == '\n') {
      lines.emplace_back(1);
    } else {
      lines.back().back() += c;
    }
  }
  EXPECT_FALSE(quoted);
  lines.pop_back();  // after the last line's end
  std::vector<CsvRow> rows;
  for (size_t i = 1; i < lines.size(); ++i) {
    EXPECT_EQ(lines[i].size(), lines[0].size()) << "line " << i + 1;
    CsvRow row;
    for (size_t k = 0; k < lines[i].size(); ++k) row[lines[0].at(k)] = lines[i][k];
    rows.push_back(row);
  }
  return rows;
}

}  // namespace poise
