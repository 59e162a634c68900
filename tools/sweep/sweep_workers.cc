#include "tools/sweep/sweep_workers.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <system_error>

#include "components/framework/clock.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "tools/cli/output_place.h"

namespace poise {
namespace {

constexpr int kThrew = 3;  // exit code of a task whose work threw
// Outside the ticks one step may be long: a robot's file is read, a figure of a long run made.
constexpr int64_t kStepPatience = 15 * kStallPatience;

[[noreturn]] void Work(const std::function<std::string(TaskStatus*)>& work, TaskStatus* status,
                       int pipe, pid_t parent) {
  setpgid(0, 0);  // Ctrl-C is the parent's
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kThrew);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);
  std::string text;
  int code = 0;
  try {
    text = work(status);
  } catch (const std::exception& error) {
    text = error.what();
    code = kThrew;
  } catch (...) {
    text = "an exception that is no std::exception";
    code = kThrew;
  }
  status->SetReturned();
  _exit(WriteAll(pipe, text) ? code : kThrew);
}

}  // namespace

void TaskStatus::SetRun(const std::vector<std::pair<std::string, std::string>>& stages,
                        double period, int64_t lead) {
  size_t at = 0;
  for (const auto& [component, stage] : stages) {
    if (at + component.size() + stage.size() + 4 > kRoom) break;
    for (const std::string& name : {component, stage}) {
      std::memcpy(names_ + at, name.c_str(), name.size() + 1);
      at += name.size() + 1;
    }
  }
  lead_.store(lead);
  period_.store(period);
}

RunPlace TaskStatus::Place() const {
  const int64_t tick = position_.tick.load();
  RunPlace place;
  if (tick >= 0) place.time = MakeTick(tick, period_.load(), lead_.load()).time;
  const char* name = names_;
  for (int32_t i = position_.stage.load(); i >= 0 && *name != '\0'; --i) {
    place.component = name;
    name += place.component.size() + 1;
    place.stage = name;
    name += place.stage.size() + 1;
  }
  return place;
}

int64_t TaskStatus::Hangs(StallWatch* watch, int64_t now) const {
  const int32_t stage = position_.stage.load(std::memory_order_relaxed);
  const int64_t tick = position_.tick.load(std::memory_order_relaxed);
  constexpr int64_t kMostStages = 1 << 10;
  const int64_t stood = watch->Stood((tick + steps_.load()) * kMostStages + stage, now);
  const int64_t patience = stage == RunPosition::kNoStage ? kStepPatience : kStallPatience;
  return stood > patience && !elsewhere_.load() ? stood : 0;
}

ForkedTasks::~ForkedTasks() {
  for (const Task& task : tasks_) kill(task.pid, SIGKILL);
  for (Task& task : tasks_) Finish(&task);
}

void ForkedTasks::Start(int64_t id, const std::function<std::string(TaskStatus*)>& work) {
  void* const shared =
      mmap(nullptr, sizeof(TaskStatus), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) {
    throw std::system_error(errno, std::generic_category(), "memory of a run");
  }
  Task task;
  task.id = id;
  task.status = new (shared) TaskStatus;
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    const int error = errno;
    munmap(shared, sizeof(TaskStatus));
    throw std::system_error(error, std::generic_category(), "pipe of a run");
  }
  std::fflush(nullptr);  // else the child would hold a copy
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) {
    close(ends[0]);
    Work(work, task.status, ends[1], parent);
  }
  const int error = errno;
  close(ends[1]);
  if (pid < 0) {
    close(ends[0]);
    munmap(shared, sizeof(TaskStatus));
    throw std::system_error(error, std::generic_category(), "process of a run");
  }
  task.pid = pid;
  task.pipe = ends[0];
  tasks_.push_back(std::move(task));
}

ForkedTasks::Result ForkedTasks::Finish(Task* task) {
  close(task->pipe);
  int status = 0;
  while (waitpid(task->pid, &status, 0) < 0 && errno == EINTR) {
  }
  Result result;
  result.id = task->id;
  const bool returned = task->status->returned(), in_stage = task->status->InStage();
  result.crashed = WIFSIGNALED(status) || !returned || in_stage;
  if (result.crashed) result.place = task->status->Place();
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    result.problem = fmt::format("ended by signal {} ({})", signal, sigdescr_np(signal));
  } else if (!returned) {
    result.problem =
        fmt::format("{} the program with exit code {}",
                    in_stage ? "its stage ended" : "something ended", WEXITSTATUS(status));
  } else if (in_stage) {
    result.problem = "its stage threw: " + task->text;
  } else if (WEXITSTATUS(status) == 0) {
    result.answer = std::move(task->text);
  } else {
    result.problem = task->text.empty() ? "ended without an answer" : std::move(task->text);
  }
  munmap(task->status, sizeof(TaskStatus));
  return result;
}

std::vector<ForkedTasks::Result> ForkedTasks::Wait(int milliseconds) {
  std::vector<pollfd> polls;
  for (const Task& task : tasks_) polls.push_back({task.pipe, POLLIN, 0});
  std::vector<Result> results;
  const int ready = poll(polls.data(), polls.size(), milliseconds);
  const int64_t now = NowNanoseconds();
  for (size_t i = polls.size(); i-- > 0;) {
    if (ready <= 0 || polls[i].revents == 0) {
      Task& task = tasks_[i];
      const int64_t stood = task.status->Hangs(&task.watch, now);
      if (stood == 0) continue;
      kill(task.pid, SIGKILL);
      Result result = Finish(&task);
      result.hung = true;
      result.crashed = false;
      result.answer.reset();
      const bool in_stage = !result.place.stage.empty();
      result.problem = fmt::format(
          "{} for {} s", in_stage ? "its stage has not returned" : "the program has not gone on",
          (in_stage ? kStallPatience : kStepPatience) / 1'000'000'000);
      results.push_back(std::move(result));
      tasks_.erase(tasks_.begin() + static_cast<std::ptrdiff_t>(i));
      continue;
    }
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
