#include "tools/sweep/sweep_workers.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <system_error>

#include "fmt/format.h"

namespace poise {
namespace {

constexpr int kThrew = 3;  // exit code of a task whose work threw

bool WriteAll(int fd, const std::string& text) {
  size_t written = 0;
  while (written < text.size()) {
    const ssize_t count = write(fd, text.data() + written, text.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    written += static_cast<size_t>(count);
  }
  return true;
}

[[noreturn]] void Work(const std::function<std::string()>& work, int pipe, pid_t parent) {
  setpgid(0, 0);  // Ctrl-C is the parent's
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kThrew);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);
  std::string text;
  int code = 0;
  try {
    text = work();
  } catch (const std::exception& error) {
    text = error.what();
    code = kThrew;
  }
  _exit(WriteAll(pipe, text) ? code : kThrew);
}

}  // namespace

ForkedTasks::~ForkedTasks() {
  for (const Task& task : tasks_) kill(task.pid, SIGKILL);
  for (Task& task : tasks_) Finish(&task);
}

void ForkedTasks::Start(int64_t id, const std::function<std::string()>& work) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    throw std::system_error(errno, std::generic_category(), "pipe of a run");
  }
  std::fflush(nullptr);  // else the child would hold a copy
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) {
    close(ends[0]);
    Work(work, ends[1], parent);
  }
  const int error = errno;
  close(ends[1]);
  if (pid < 0) {
    close(ends[0]);
    throw std::system_error(error, std::generic_category(), "process of a run");
  }
  tasks_.push_back({id, pid, ends[0], ""});
}

ForkedTasks::Result ForkedTasks::Finish(Task* task) {
  close(task->pipe);
  int status = 0;
  while (waitpid(task->pid, &status, 0) < 0 && errno == EINTR) {
  }
  Result result;
  result.id = task->id;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    result.answer = std::move(task->text);
  } else if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    constexpr int kOwn[] = {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL};
    result.crashed = std::find(std::begin(kOwn), std::end(kOwn), signal) != std::end(kOwn);
    result.problem = fmt::format("ended by signal {} ({})", signal, sigdescr_np(signal));
  } else {
    result.problem = task->text.empty() ? "ended without an answer" : std::move(task->text);
  }
  return result;
}

std::vector<ForkedTasks::Result> ForkedTasks::Wait(int milliseconds) {
  std::vector<pollfd> polls;
  for (const Task& task : tasks_) polls.push_back({task.pipe, POLLIN, 0});
  std::vector<Result> results;
  if (poll(polls.data(), polls.size(), milliseconds) <= 0) return results;
  for (size_t i = polls.size(); i-- > 0;) {
    if (polls[i].revents == 0) continue;
    char buffer[65536];
    const ssize_t count = read(tasks_[i].pipe, buffer, sizeof buffer);
    if (count > 0) {
      tasks_[i].text.append(buffer, static_cast<size_t>(count));
    } else if (count == 0 || errno != EINTR) {
      results.push_back(Finish(&tasks_[i]));
      tasks_.erase(tasks_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  return results;
}

}  // namespace poise
