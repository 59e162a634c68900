// Tasks in processes of their own: answers, exceptions, crashes, ends.
#include "tools/sweep/sweep_workers.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <map>
#include <stdexcept>
#include <thread>

namespace poise {
namespace {

std::map<int64_t, ForkedTasks::Result> WaitForAll(ForkedTasks* tasks) {
  std::map<int64_t, ForkedTasks::Result> results;
  while (tasks->running() > 0) {
    for (ForkedTasks::Result& result : tasks->Wait(1000)) results[result.id] = std::move(result);
  }
  return results;
}

TEST(ForkedTasks, GiveTheirAnswers) {
  ForkedTasks tasks(4);
  const std::string large(3'000'000, 'x');  // more than a pipe holds
  tasks.Start(7, [](TaskStatus*) { return std::string("seven"); });
  tasks.Start(8, [](TaskStatus*) { return std::string(); });
  tasks.Start(9, [&](TaskStatus*) { return large; });
  EXPECT_FALSE(tasks.full());
  tasks.Start(10, [](TaskStatus*) { return std::string("a\0b", 3); });
  EXPECT_TRUE(tasks.full());
  auto results = WaitForAll(&tasks);
  EXPECT_EQ(results[7].answer, "seven");
  EXPECT_EQ(results[8].answer, "");
  EXPECT_EQ(results[9].answer, large);
  EXPECT_EQ(results[10].answer, std::string("a\0b", 3));
}

TEST(ForkedTasks, ACrashIsItsOwn) {
  ForkedTasks tasks(5);
  tasks.Start(0, [](TaskStatus*) -> std::string { std::abort(); });
  tasks.Start(1, [](TaskStatus*) -> std::string {
    raise(SIGSEGV);
    return "not reached";
  });
  tasks.Start(2, [](TaskStatus*) -> std::string {
    raise(SIGKILL);
    return "not reached";
  });
  tasks.Start(3, [](TaskStatus*) -> std::string { throw std::runtime_error("no room"); });
  tasks.Start(4, [](TaskStatus*) { return std::string("good"); });
  auto results = WaitForAll(&tasks);
  EXPECT_FALSE(results[0].answer);
  EXPECT_TRUE(results[0].crashed);
  EXPECT_NE(results[0].problem.find("Aborted"), std::string::npos) << results[0].problem;
  EXPECT_TRUE(results[1].crashed);
  EXPECT_TRUE(results[2].crashed) << "whoever killed it";
  EXPECT_FALSE(results[2].answer);
  EXPECT_FALSE(results[3].answer);
  EXPECT_FALSE(results[3].crashed);
  EXPECT_EQ(results[3].problem, "no room");
  EXPECT_EQ(results[4].answer, "good");
}

TEST(ForkedTasks, ACrashTellsWhereItWas) {
  ForkedTasks tasks(1);
  tasks.Start(0, [](TaskStatus* status) -> std::string {
    status->SetRun({{"estimator", "estimate"}, {"controller", "control"}}, 0.002, 50);
    status->position()->tick.store(150);
    status->position()->stage.store(1);
    std::abort();
  });
  const RunPlace place = WaitForAll(&tasks)[0].place;
  EXPECT_EQ(place.component, "controller");
  EXPECT_EQ(place.stage, "control");
  EXPECT_EQ(place.time, 0.2);
}

// What a stage throws is its own fault; outside the stages it is the machine's: no memory, no disk.
TEST(ForkedTasks, AnExceptionOfAStageAndAnExitAreCrashes) {
  const auto in_stage = [](TaskStatus* status) {
    status->SetRun({{"controller", "control"}}, 0.002, 0);
    status->position()->stage.store(0);
  };
  ForkedTasks tasks(4);
  tasks.Start(0, [&](TaskStatus* status) -> std::string {
    in_stage(status);
    throw std::runtime_error("no gain");
  });
  tasks.Start(1, [&](TaskStatus* status) -> std::string {
    in_stage(status);
    throw 3;
  });
  tasks.Start(2, [&](TaskStatus* status) -> std::string {
    in_stage(status);
    std::exit(0);
  });
  tasks.Start(3, [](TaskStatus*) -> std::string { std::exit(5); });
  auto results = WaitForAll(&tasks);
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(results[i].crashed) << i;
    EXPECT_FALSE(results[i].answer) << i;
    EXPECT_EQ(results[i].place.stage, i < 3 ? "control" : "") << i;
  }
  EXPECT_EQ(results[0].problem, "its stage threw: no gain");
  EXPECT_EQ(results[1].problem, "its stage threw: an exception that is no std::exception");
  EXPECT_EQ(results[2].problem, "its stage ended the program with exit code 0");
  EXPECT_EQ(results[3].problem, "something ended the program with exit code 5");
}

constexpr int64_t kOneSecond = 1'000'000'000;  // ns

/// Looks at `status` every 0.1 s for `seconds`, and lets `go_on` happen before each look; how often
/// it hangs.
int Looks(const TaskStatus& status, int seconds, StallWatch* watch, int64_t* now,
          const std::function<void()>& go_on = {}) {
  int hangs = 0;
  for (int i = 0; i < 10 * seconds; ++i) {
    if (go_on) go_on();
    *now += kOneSecond / 10;
    hangs += status.Hangs(watch, *now) > 0 ? 1 : 0;
  }
  return hangs;
}

TEST(TaskStatus, HangsWhereAStageDoesNotReturn) {
  TaskStatus status;
  StallWatch watch;
  int64_t now = kOneSecond;
  EXPECT_EQ(Looks(status, 100, &watch, &now), 0) << "outside the ticks a step may be long";
  status.position()->tick.store(0);
  status.position()->stage.store(3);
  EXPECT_EQ(Looks(status, 19, &watch, &now), 0);
  EXPECT_GT(Looks(status, 3, &watch, &now), 0);
  // However slow a busy machine makes it, it goes on.
  int64_t tick = 0;
  EXPECT_EQ(
      Looks(status, 1000, &watch, &now, [&] { status.position()->tick.store(1 + ++tick / 100); }),
      0);
}

// Ctrl-Z, a debugger or a frozen container halt the one who looks, too.
TEST(TaskStatus, AHaltOfTheWatcherIsNone) {
  TaskStatus status;
  StallWatch watch;
  int64_t now = kOneSecond;
  status.position()->stage.store(3);
  for (int i = 0; i < 20; ++i) {
    now += 3600 * kOneSecond;
    EXPECT_EQ(status.Hangs(&watch, now), 0);
  }
}

TEST(TaskStatus, ARunOfProcessesIsWatchedByItsLauncher) {
  TaskStatus status;
  StallWatch watch;
  int64_t now = kOneSecond;
  status.SetWatchedElsewhere();
  EXPECT_EQ(Looks(status, 1000, &watch, &now), 0);
}

TEST(ForkedTasks, LeaveNothingBehind) {
  ForkedTasks tasks(1);
  int count = 0;
  for (int i = 0; i < 3; ++i) {
    tasks.Start(i, [&](TaskStatus*) { return std::to_string(++count); });
    EXPECT_EQ(WaitForAll(&tasks)[i].answer, "1");
  }
  EXPECT_EQ(count, 0);
}

TEST(ForkedTasks, EndWithTheirOwner) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  {
    ForkedTasks tasks(2);
    for (int i = 0; i < 2; ++i) {
      tasks.Start(i, [](TaskStatus*) -> std::string {
        while (true) pause();
      });
    }
    EXPECT_TRUE(tasks.Wait(1).empty());
  }
  close(ends[1]);
  char byte;
  EXPECT_EQ(read(ends[0], &byte, 1), 0);  // the end of the file: no process holds the other end
  close(ends[0]);
}

}  // namespace
}  // namespace poise
