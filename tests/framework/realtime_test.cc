// What real time changes: who waits for whom, and what is skipped.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <optional>

#include "components/framework/bus/inbox.h"
#include "components/framework/runners/state_store.h"
#include "components/framework/runners/timing.h"
#include "poise/external_push_t.hpp"
#include "tests/framework/process_harness.h"
#include "tests/framework/toy_components.h"

namespace poise {
namespace {

constexpr int64_t kRunId = 77;

/// An input port with its inbox, and packets for it.
struct Mailbox {
  explicit Mailbox(Join join) {
    wiring.AddInput(&input, "push", {});
    inbox = std::make_unique<Inbox>(&input, kRunId, join);
  }
  void Offer(int64_t tick) {
    external_push_t message{};
    message.run_id = kRunId;
    message.tick = tick;
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    inbox->Offer(bytes.data(), bytes.size());
  }
  /// Tick of what the component sees; -1: nothing.
  int64_t Seen() {
    inbox->Show(false);
    return input.present() ? input->tick : -1;
  }
  Input<external_push_t> input;
  Wiring wiring;
  std::unique_ptr<Inbox> inbox;
};

TEST(Inbox, InLockstepKeepsWhatComesEarlyAndRefusesWhatIsOver) {
  Mailbox box(Join::kEvery);
  box.inbox->Want(5);
  box.Offer(6);
  EXPECT_FALSE(box.inbox->ready());
  box.Offer(4);
  box.Offer(5);
  EXPECT_EQ(box.Seen(), 5);
  box.inbox->Want(6);
  EXPECT_EQ(box.Seen(), 6);
  EXPECT_EQ(box.inbox->counters().count(PacketVerdict::kStaleTick), 1);
}

TEST(Inbox, AFollowerTakesTheNewestUpToItsHorizon) {
  Mailbox box(Join::kNewest);
  box.inbox->Want(10);
  box.inbox->set_horizon(2000);
  EXPECT_EQ(box.inbox->newest(), -1);
  for (const int64_t tick : {9, 10, 11, 1500}) box.Offer(tick);
  EXPECT_EQ(box.inbox->newest(), 1500);
  box.Offer(2001);  // nobody can be so far ahead
  EXPECT_EQ(box.inbox->newest(), 1500);
  EXPECT_EQ(box.inbox->counters().count(PacketVerdict::kFutureTick), 1);
  EXPECT_TRUE(box.inbox->Has(11));
  EXPECT_FALSE(box.inbox->Has(12));
  box.inbox->Want(1500);
  EXPECT_EQ(box.Seen(), 1500);
  box.inbox->Want(1501);
  EXPECT_EQ(box.inbox->newest(), -1);
}

TEST(Inbox, TheClocksOwnerSeesALateMessageOnce) {
  Mailbox box(Join::kLate);
  box.inbox->Want(3);
  box.Offer(3);
  EXPECT_EQ(box.Seen(), 3);
  box.inbox->Want(4);  // does not come in its cycle
  box.inbox->TakeLate();
  EXPECT_EQ(box.Seen(), -1);
  box.inbox->Want(5);
  box.Offer(4);
  EXPECT_FALSE(box.inbox->ready());
  box.inbox->TakeLate();
  EXPECT_EQ(box.Seen(), 4);
  box.inbox->Want(6);
  box.inbox->TakeLate();
  EXPECT_EQ(box.Seen(), -1) << "shown twice";
  box.Offer(5);
  box.Offer(6);
  EXPECT_TRUE(box.inbox->ready());
  EXPECT_EQ(box.Seen(), 6) << "its own cycle's is better";
  box.inbox->Want(7);
  box.inbox->TakeLate();
  EXPECT_EQ(box.Seen(), -1) << "5 is older than 6, which has been seen";
}

TEST(Inbox, AMessageThatCameAfterItsCycleIsLateInTheNext) {
  Mailbox box(Join::kLate);
  box.inbox->Want(3);
  box.inbox->TakeLate();
  EXPECT_EQ(box.Seen(), -1);
  box.Offer(3);
  box.inbox->Want(4);
  box.inbox->TakeLate();
  EXPECT_EQ(box.Seen(), 3);
}

TEST(StateStore, KeepsTheLatestAcrossMappings) {
  const FileDescriptor fd = StateStore::MakeMemoryFile("state");
  const std::string path = "/proc/self/fd/" + std::to_string(fd);
  StateStore writer(path);
  EXPECT_EQ(writer.tick(), -1);
  EXPECT_TRUE(writer.latest().empty());
  for (int64_t tick = 0; tick < 5; ++tick) {
    writer.Next()[0] = static_cast<uint8_t>(10 + tick);
    writer.Commit(tick, 1);
  }
  writer.Next()[0] = 99;  // not committed: died in the middle
  const StateStore reader(path);
  EXPECT_EQ(reader.tick(), 4);
  ASSERT_EQ(reader.latest().size(), 1u);
  EXPECT_EQ(reader.latest()[0], 14);
}

TEST(StateStore, RefusesAFileThatIsNone) {
  EXPECT_THROW(StateStore("/proc/self/status"), std::system_error);
  EXPECT_THROW(StateStore("/nowhere/state"), std::system_error);
}

RunSpec RealtimeToys(int64_t ticks) {
  Graph graph = ToyLoop();
  for (ComponentInstance& instance : *graph.mutable_component()) {
    if (instance.name() == "plant") instance.set_plant(true);
    if (instance.name() == "controller") instance.set_owns_clock(true);
  }
  RunSpec spec = ToyRun(graph, ticks);
  spec.set_realtime(true);
  spec.set_tick_period(0.002);
  spec.mutable_realtime_options()->set_priority(0);
  return spec;
}

TEST(Realtime, EachComponentHasItsPlace) {
  RunSpec spec = RealtimeToys(10);
  EXPECT_EQ(TimingOf(spec, 0), Timing::kOwner);
  EXPECT_EQ(TimingOf(spec, 1), Timing::kFollower);
  EXPECT_EQ(TimingOf(spec, 2), Timing::kPlant);
  spec.mutable_graph()->mutable_component(0)->set_owns_clock(false);
  EXPECT_EQ(TimingOf(spec, 1), Timing::kLockstep) << "nobody owns the clock";
  spec = RealtimeToys(10);
  spec.set_realtime(false);
  EXPECT_EQ(TimingOf(spec, 0), Timing::kLockstep);
}

// The robot's first message is sent before the owner of the clock exists.
TEST(Realtime, TheClocksOwnerMayComeLast) {
  constexpr size_t kPush = 4;
  constexpr int64_t kTicks = 50;
  const RunSpec spec = RealtimeToys(kTicks);
  ASSERT_TRUE(spec.graph().component(0).owns_clock());
  HarnessOptions options;
  options.reverse = true;
  options.late_after_ms = 300;
  options.max_seconds = 20;
  const ProcessRun run = RunAsProcesses(spec, options);
  ASSERT_FALSE(run.timed_out) << run.messages[kPush].size() << " of the robot's messages";
  EXPECT_EQ(run.final_tick, kTicks - 1);
  EXPECT_EQ(std::ssize(run.messages[kPush]), kTicks);
  for (const auto& [name, code] : run.exit_codes) EXPECT_EQ(code, 0) << name;
}

TEST(Realtime, TheRobotGetsEveryCycleWhileAProcessIsStopped) {
  constexpr size_t kState = 1, kPush = 4;
  constexpr int64_t kTicks = 1500;
  RunSpec spec = RealtimeToys(kTicks);
  size_t stopped_at = 0;
  bool continued = false;
  HarnessOptions options;
  options.disturb = [&](const std::map<std::string, pid_t>& pids, const Messages& messages) {
    const size_t now = messages[kPush].size();
    if (stopped_at == 0 && now >= 50) {
      kill(pids.at("filter"), SIGSTOP);
      stopped_at = now;
    } else if (stopped_at > 0 && !continued &&
               now >= std::min(stopped_at + 100, static_cast<size_t>(kTicks))) {
      kill(pids.at("filter"), SIGCONT);
      continued = true;
    }
  };
  const ProcessRun run = RunAsProcesses(spec, options);
  ASSERT_FALSE(run.timed_out) << "stopped at " << stopped_at << ", of the last message's channel "
                              << run.messages[kPush].size();
  ASSERT_TRUE(continued);
  ASSERT_LT(stopped_at, kTicks - 300) << "this process came too late to disturb the run";
  EXPECT_EQ(run.final_tick, kTicks - 1);
  for (const auto& [name, code] : run.exit_codes) EXPECT_EQ(code, 0) << name;
  ASSERT_EQ(std::ssize(run.messages[kPush]), kTicks);
  for (const std::vector<uint8_t>& message : run.messages[kPush]) EXPECT_FALSE(message.empty());
  int64_t skipped = 0, after = 0;
  for (size_t tick = 0; tick < run.messages[kState].size(); ++tick) {
    skipped += run.messages[kState][tick].empty() ? 1 : 0;
    after += tick > stopped_at + 150 && !run.messages[kState][tick].empty() ? 1 : 0;
  }
  EXPECT_GE(skipped, 50) << "100 cycles went by";
  EXPECT_GT(after, 0) << "it came back";
  EXPECT_GE(run.health.at("filter").ticks_skipped, 50);
  EXPECT_EQ(run.health.at("controller").ticks_completed, kTicks);
}

TEST(Realtime, CyclesThatNeverBeganAreCounted) {
  constexpr size_t kPush = 4;
  constexpr int64_t kTicks = 600;
  using Clock = std::chrono::steady_clock;
  std::optional<Clock::time_point> stopped;
  bool continued = false;
  HarnessOptions options;
  options.disturb = [&](const std::map<std::string, pid_t>& pids, const Messages& messages) {
    if (!stopped && messages[kPush].size() >= 50) {
      kill(pids.at("controller"), SIGSTOP);
      stopped = Clock::now();
    } else if (stopped && !continued && Clock::now() - *stopped >= std::chrono::milliseconds(200)) {
      kill(pids.at("controller"), SIGCONT);
      continued = true;
    }
  };
  const ProcessRun run = RunAsProcesses(RealtimeToys(kTicks), options);
  ASSERT_FALSE(run.timed_out);
  ASSERT_TRUE(continued);
  EXPECT_EQ(run.final_tick, kTicks - 1);
  EXPECT_GE(run.health.at("controller").ticks_skipped, 98) << "200 ms of 2 ms each";
}

}  // namespace
}  // namespace poise
