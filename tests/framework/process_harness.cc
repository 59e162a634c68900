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
#include <optional>
#include <set>

#include "components/framework/bus/channel_collector.h"
#include "components/framework/bus/control_client.h"
#include "components/framework/run.h"
#include "components/framework/runners/inline_runner.h"
#include "tests/framework/toy_components.h"

namespace poise {
namespace {

using Clock = std::chrono::steady_clock;

pid_t Start(const std::vector<std::string>& arguments, int stderr_fd = -1, int kept_fd = -1) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t pid = fork();
  if (pid == 0) {
    if (stderr_fd >= 0) dup2(stderr_fd, 2);
    if (kept_fd >= 0) fcntl(kept_fd, F_SETFD, 0);
    execv(argv[0], argv.data());
    _exit(127);
  }
  return pid;
}

int ExitCode(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status); }

/// The children of one run; ends what is left.
class Children {
 public:
  Children(const RunSpec& spec, const RunSocket& socket) : socket_(socket.fd()) {
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
  void StartOne(const Graph& graph, const std::string& process) {
    const std::vector<int> members = ComponentsOf(graph, process);
    const ComponentInstance& first = graph.component(members.front());
    std::vector<std::string> command = {TOY_PROCESS, TypeOf(first), "--component", first.name()};
    if (members.size() > 1) command = {TOY_PROCESS, "host", "--process", process};
    command.insert(command.end(), {"--run", path_, "--socket", std::to_string(socket_)});
    pids[process] = Start(command, -1, socket_);
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
  int socket_;
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
  FillPlan(BoundGraph(spec, registry).plan(), spec.mutable_graph());
  spec.set_recorded(options.collect);

  ProcessRun run;
  run.messages.resize(static_cast<size_t>(spec.graph().channel_size()));
  std::optional<RunSource> source;
  if (options.socket == nullptr) source.emplace(spec);
  const RunSocket& socket = source ? source->socket() : *options.socket;
  ChannelCollector collector(spec, socket, "recorder",
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
  ControlClient control(spec, &socket);
  Children children(spec, socket);
  std::vector<std::string> order = ProcessNames(spec.graph());
  if (options.reverse) std::reverse(order.begin(), order.end());
  bool late = options.late_after_ms > 0;
  for (size_t i = 0; i + (late ? 1 : 0) < order.size(); ++i)
    children.StartOne(spec.graph(), order[i]);

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
      children.StartOne(spec.graph(), order.back());
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

void Configure(RunSpec* spec, const std::string& name, const std::string& text) {
  ComponentConfig* config = spec->add_config();
  config->set_component(name);
  config->set_text(text);
}

void ExpectEqualToInline(const RunSpec& spec, const ProcessRun& run, int64_t ticks) {
  ASSERT_FALSE(run.timed_out);
  EXPECT_EQ(run.final_tick, ticks - 1);
  EXPECT_EQ(run.missing, 0);
  for (const auto& [name, code] : run.exit_codes) EXPECT_EQ(code, 0) << name;
  EXPECT_EQ(run.exit_codes.size(), ProcessNames(spec.graph()).size());
  const Messages expected = RunInline(spec);
  for (size_t channel = 0; channel < expected.size(); ++channel) {
    const std::string& name = spec.graph().channel(static_cast<int>(channel)).name();
    ASSERT_EQ(run.messages[channel].size(), expected[channel].size()) << name;
    for (size_t tick = 0; tick < expected[channel].size(); ++tick) {
      ASSERT_EQ(run.messages[channel][tick], expected[channel][tick]) << name << " tick " << tick;
    }
  }
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
