#include "tests/framework/process_harness.h"

#include <fcntl.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <fstream>
#include <set>

#include "components/framework/bus/channel_collector.h"
#include "components/framework/bus/control_client.h"
#include "components/framework/run.h"
#include "components/framework/runners/inline_runner.h"
#include "tests/framework/toy_components.h"

namespace poise {
namespace {

using Clock = std::chrono::steady_clock;

pid_t Start(const std::vector<std::string>& arguments, int stderr_fd = -1) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t pid = fork();
  if (pid == 0) {
    if (stderr_fd >= 0) dup2(stderr_fd, 2);
    execv(argv[0], argv.data());
    _exit(127);
  }
  return pid;
}

int ExitCode(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status); }

/// The children of one run; ends what is left.
class Children {
 public:
  explicit Children(const RunSpec& spec) {
    path_ = testing::TempDir() + "/toy_run_" + std::to_string(getpid()) + ".pbtxt";
    std::string text;
    google::protobuf::TextFormat::PrintToString(spec, &text);
    std::ofstream(path_) << text;
  }
  ~Children() {
    for (const auto& [name, pid] : pids) {
      kill(pid, SIGKILL);
      waitpid(pid, nullptr, 0);
    }
    unlink(path_.c_str());
  }
  void StartOne(const ComponentInstance& instance) {
    pids[instance.name()] =
        Start({TOY_PROCESS, TypeOf(instance), "--run", path_, "--component", instance.name()});
  }
  /// Collects those that have ended.
  void Reap(std::map<std::string, int>* exit_codes) {
    for (auto it = pids.begin(); it != pids.end();) {
      int status = 0;
      if (waitpid(it->second, &status, WNOHANG) != it->second) {
        ++it;
        continue;
      }
      (*exit_codes)[it->first] = ExitCode(status);
      it = pids.erase(it);
    }
  }
  std::map<std::string, pid_t> pids;

 private:
  std::string path_;
};

}  // namespace

Messages RunInline(const RunSpec& spec) {
  ComponentRegistry registry;
  AddToyComponents(&registry);
  InlineRunner runner(spec, registry);
  Messages messages(runner.plan().channels.size());
  runner.set_tap([&](int channel, const OutputPort& output, const Tick&) {
    std::vector<uint8_t> bytes(static_cast<size_t>(output.encoded_size()));
    EXPECT_EQ(output.Encode(bytes.data(), static_cast<int>(bytes.size())),
              static_cast<int>(bytes.size()));
    messages[static_cast<size_t>(channel)].push_back(bytes);
  });
  runner.Run(INT64_MAX);
  return messages;
}

ProcessRun RunAsProcesses(RunSpec spec, const HarnessOptions& options) {
  ComponentRegistry registry;
  AddToyComponents(&registry);
  FillCounts(BoundGraph(spec, registry).plan(), spec.mutable_graph());
  spec.set_recorded(options.collect);

  ProcessRun run;
  run.messages.resize(static_cast<size_t>(spec.graph().channel_size()));
  ChannelCollector collector(spec, "recorder",
                             {[&](int channel, int64_t tick, std::span<const uint8_t> data) {
                                auto& lane = run.messages[static_cast<size_t>(channel)];
                                if (!spec.graph().channel(channel).external()) {
                                  // What real time has skipped stays empty.
                                  if (spec.realtime() && tick > std::ssize(lane)) {
                                    lane.resize(static_cast<size_t>(tick));
                                  }
                                  EXPECT_EQ(tick, static_cast<int64_t>(lane.size()))
                                      << "channel " << channel;
                                }
                                lane.emplace_back(data.begin(), data.end());
                              },
                              nullptr});
  ControlClient control(spec);
  Children children(spec);
  std::vector<ComponentInstance> order(spec.graph().component().begin(),
                                       spec.graph().component().end());
  if (options.reverse) std::reverse(order.begin(), order.end());
  bool late = options.late_after_ms > 0;
  for (size_t i = 0; i + (late ? 1 : 0) < order.size(); ++i) children.StartOne(order[i]);

  const auto begin = Clock::now();
  auto next_start = begin;
  bool stopping = false;
  bool running = false;
  bool ended = false;
  while (!children.pids.empty()) {
    collector.Spin(2);
    control.Spin(0);
    children.Reap(&run.exit_codes);
    const auto now = Clock::now();
    if (late && now - begin > std::chrono::milliseconds(options.late_after_ms)) {
      children.StartOne(order.back());
      late = false;
    }
    running = running || control.AllReached(health_t::STATE_RUNNING);
    if (!running && now >= next_start) {
      control.SendStart();
      next_start = now + std::chrono::milliseconds(50);
    }
    if (running && !stopping && options.while_running) options.while_running();
    if (running && !stopping && options.disturb) options.disturb(children.pids, run.messages);
    if (running && !ended && options.end && options.end(children.pids)) {
      ended = true;
      for (const auto& [name, pid] : children.pids) kill(pid, SIGTERM);
    }
    const bool all_ended = control.AllReached(health_t::STATE_FINISHED);
    if (options.collect ? collector.complete() : all_ended) stopping = true;
    if (stopping) control.SendStop();
    if (now - begin > std::chrono::seconds(options.max_seconds)) {
      run.timed_out = true;
      break;
    }
  }
  control.Spin(0);  // the last reports
  for (const auto& [name, status] : control.statuses()) run.health[name] = status.health;
  run.final_tick = collector.final_tick();
  run.missing = collector.missing(run.final_tick);
  for (int i = 0; i < spec.graph().channel_size(); ++i) {
    auto& lane = run.messages[static_cast<size_t>(i)];
    if (!spec.graph().channel(i).external() && run.final_tick >= 0 &&
        std::ssize(lane) > run.final_tick + 1) {
      lane.resize(static_cast<size_t>(run.final_tick + 1));
    }
  }
  return run;
}

std::pair<int, std::string> RunProgram(const std::vector<std::string>& arguments) {
  std::array<int, 2> ends{};
  EXPECT_EQ(pipe(ends.data()), 0);
  const pid_t pid = Start(arguments, ends[1]);
  close(ends[1]);
  std::string text;
  std::array<char, 512> buffer{};
  for (ssize_t n; (n = read(ends[0], buffer.data(), buffer.size())) > 0;)
    text.append(buffer.data(), static_cast<size_t>(n));
  close(ends[0]);
  int status = 0;
  waitpid(pid, &status, 0);
  return {ExitCode(status), text};
}

}  // namespace poise
