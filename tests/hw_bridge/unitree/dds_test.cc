// Both ends on DDS, on loopback: what one writes the other reads.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "components/framework/clock.h"
#include "hw_bridge/unitree/crc.h"
#include "hw_bridge/unitree/dds_link.h"

namespace poise::unitree {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

DdsLink Loopback() {
  DdsLink link;
  link.set_tag(fmt::format("poise-test-{}", getpid()));
  return link;
}

TEST(Dds, CarriesStatesCommandsAndRequests) {
  Participant robot(Loopback());
  Writer<LowState> states(robot, kStateTopic);
  Reader<LowCmd> commands(robot, kCommandTopic, 16);
  MotionSwitcherServer switcher(robot, "ai");
  DdsRobotLink link(Loopback());

  std::atomic<bool> over = false;
  std::thread server([&] {
    while (!over) {
      switcher.Serve();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  EXPECT_EQ(link.ActiveMode(link.Now() + 10 * kSecond), "ai");
  EXPECT_TRUE(link.Release(link.Now() + 10 * kSecond));
  EXPECT_EQ(link.ActiveMode(link.Now() + 10 * kSecond), "");
  over = true;
  server.join();

  // Whoever is new is not heard at first: the first state is said until it is.
  LowState sent{}, state{};
  sent.tick = 1;
  sent.motor_state[34].q = 0.25F;
  sent.wireless_remote[39] = 7;
  sent.crc = CrcOf(sent);
  bool heard = false;
  for (int i = 0; i < 200 && !heard; ++i) {
    states.Write(sent);
    heard = link.Receive(&state, link.Now() + kSecond / 20);
  }
  ASSERT_TRUE(heard);
  EXPECT_EQ(CrcOf(state), state.crc);
  EXPECT_EQ(state.motor_state[34].q, 0.25F);

  LowCmd command{}, told{};
  command.motor_cmd[0].tau = 3;
  command.crc = CrcOf(command);
  heard = false;
  for (int i = 0; i < 200 && !heard; ++i) {
    EXPECT_TRUE(link.Send(command));
    heard = commands.Await(NowNanoseconds() + kSecond / 20) && commands.Take(&told);
  }
  ASSERT_TRUE(heard);
  EXPECT_EQ(told.motor_cmd[0].tau, 3);
  EXPECT_EQ(told.crc, CrcOf(told));
}

TEST(Dds, StatesWaitUntilTheyAreTaken) {
  DdsLink there = Loopback();
  there.set_domain(3);
  Participant robot(there);
  Writer<LowState> states(robot, kStateTopic, kMostStates);
  DdsRobotLink link(there);
  LowState state{}, heard{};
  // Whoever is new is not heard at first.
  bool any = false;
  for (int i = 0; i < 200 && !any; ++i) {
    states.Write(state);
    any = link.Receive(&heard, link.Now() + kSecond / 20);
  }
  ASSERT_TRUE(any);
  for (uint32_t tick = 1; tick <= 10; ++tick) {
    state.tick = tick;
    ASSERT_TRUE(states.Write(state));
  }
  uint32_t next = 1;
  while (next <= 10 && link.Receive(&heard, link.Now() + 10 * kSecond)) {
    if (heard.tick == next) ++next;
  }
  EXPECT_EQ(next, 11u);
}

TEST(Dds, RunsOfOtherTagsAreNotHeard) {
  DdsLink other = Loopback();
  other.set_domain(1);
  other.set_tag(other.tag() + "-other");
  DdsLink one = Loopback();
  one.set_domain(1);
  Participant robot(one);
  Writer<LowState> states(robot, kStateTopic);
  EXPECT_THROW(DdsRobotLink link(other), UnitreeError) << "one process, one configuration";
}

TEST(Dds, SaysWhichInterfaceIsNone) {
  DdsLink link = Loopback();
  link.set_domain(2);
  link.set_interface("nosuch0");
  try {
    const Participant participant(link);
    FAIL();
  } catch (const UnitreeError& error) {
    EXPECT_NE(std::string(error.what()).find("nosuch0"), std::string::npos) << error.what();
  }
  link.set_interface("lo\"/><x");
  EXPECT_THROW(Participant{link}, UnitreeError);
}

}  // namespace
}  // namespace poise::unitree
