// Tasks in processes of their own: answers, exceptions, crashes, ends.
#include "tools/sweep/sweep_workers.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
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
  tasks.Start(7, [] { return std::string("seven"); });
  tasks.Start(8, [] { return std::string(); });
  tasks.Start(9, [&] { return large; });
  EXPECT_FALSE(tasks.full());
  tasks.Start(10, [] { return std::string("a\0b", 3); });
  EXPECT_TRUE(tasks.full());
  auto results = WaitForAll(&tasks);
  EXPECT_EQ(results[7].answer, "seven");
  EXPECT_EQ(results[8].answer, "");
  EXPECT_EQ(results[9].answer, large);
  EXPECT_EQ(results[10].answer, std::string("a\0b", 3));
}

TEST(ForkedTasks, ACrashIsItsOwn) {
  ForkedTasks tasks(5);
  tasks.Start(0, []() -> std::string { std::abort(); });
  tasks.Start(1, []() -> std::string {
    raise(SIGSEGV);
    return "not reached";
  });
  tasks.Start(2, []() -> std::string {
    raise(SIGKILL);
    return "not reached";
  });
  tasks.Start(3, []() -> std::string { throw std::runtime_error("no room"); });
  tasks.Start(4, [] { return std::string("good"); });
  auto results = WaitForAll(&tasks);
  EXPECT_FALSE(results[0].answer);
  EXPECT_TRUE(results[0].crashed);
  EXPECT_NE(results[0].problem.find("Aborted"), std::string::npos) << results[0].problem;
  EXPECT_TRUE(results[1].crashed);
  // The system's doing, not the program's.
  EXPECT_FALSE(results[2].crashed);
  EXPECT_FALSE(results[2].answer);
  EXPECT_FALSE(results[3].answer);
  EXPECT_FALSE(results[3].crashed);
  EXPECT_EQ(results[3].problem, "no room");
  EXPECT_EQ(results[4].answer, "good");
}

TEST(ForkedTasks, LeaveNothingBehind) {
  ForkedTasks tasks(1);
  int count = 0;
  for (int i = 0; i < 3; ++i) {
    tasks.Start(i, [&] { return std::to_string(++count); });
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
      tasks.Start(i, []() -> std::string {
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
