#include "tools/cli/child_process.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <deque>
#include <fstream>
#include <system_error>

#include "fmt/format.h"

namespace poise {
namespace {

/// Between fork and exec: only async-signal-safe calls.
[[noreturn]] void Become(char* const* arguments, int output, int kept, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(126);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) std::signal(signal, SIG_DFL);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  const int null = open("/dev/null", O_RDONLY);
  if (null >= 0) dup2(null, STDIN_FILENO);
  if (kept >= 0) fcntl(kept, F_SETFD, 0);  // open across exec
  execv(arguments[0], arguments);
  const char* const reason = strerrordesc_np(errno);
  for (const char* text :
       {static_cast<const char*>(arguments[0]), ": cannot be started: ", reason, "\n"}) {
    if (write(STDERR_FILENO, text, std::strlen(text)) < 0) break;
  }
  _exit(127);
}

}  // namespace

ChildProcess::ChildProcess(std::string name, const std::vector<std::string>& command,
                           std::string log_path, int kept)
    : name_(std::move(name)), log_path_(std::move(log_path)) {
  std::vector<std::string> copy = command;
  std::vector<char*> arguments;
  for (std::string& argument : copy) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  const int output = open(log_path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (output < 0) throw std::system_error(errno, std::generic_category(), log_path_);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) Become(arguments.data(), output, kept, parent);
  const int error = errno;
  close(output);
  if (pid_ < 0) throw std::system_error(error, std::generic_category(), "starting " + name_);
  setpgid(pid_, pid_);  // here too: whoever is first
}

ChildProcess::~ChildProcess() {
  if (ended()) return;
  Signal(SIGKILL);
  while (waitpid(pid_, &status_, 0) < 0 && errno == EINTR) {
  }
}

bool ChildProcess::ended() {
  if (!ended_ && waitpid(pid_, &status_, WNOHANG) == pid_) ended_ = true;
  return ended_;
}

bool ChildProcess::succeeded() const { return WIFEXITED(status_) && WEXITSTATUS(status_) == 0; }

std::string ChildProcess::HowItEnded() const {
  if (WIFSIGNALED(status_)) {
    const int signal = WTERMSIG(status_);
    return fmt::format("was ended by signal {} ({})", signal, sigdescr_np(signal));
  }
  return fmt::format("exited with code {}", WEXITSTATUS(status_));
}

ProcessorTime ChildProcess::processor_time() const {
  ProcessorTime time;
  std::ifstream times(fmt::format("/proc/{}/schedstat", pid_));
  if (!(times >> time.used >> time.waited)) return {};
  std::string stat;
  std::ifstream in(fmt::format("/proc/{}/stat", pid_));
  std::getline(in, stat);
  // "PID (NAME) STATE ...": the name may hold anything.
  const size_t end = stat.rfind(") ");
  time.ready = end != std::string::npos && end + 2 < stat.size() && stat[end + 2] == 'R';
  return time;
}

void ChildProcess::Signal(int signal) {
  if (!ended()) kill(-pid_, signal);
}

std::vector<std::string> LastLines(const std::string& path, size_t count) {
  std::ifstream in(path);
  std::deque<std::string> lines;
  std::string line;
  while (std::getline(in, line)) {
    if (line.empty()) continue;
    lines.push_back(line);
    if (lines.size() > count) lines.pop_front();
  }
  return {lines.begin(), lines.end()};
}

}  // namespace poise
