// What a run tells of impedances that its drives close, and of impacts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "logging/events/events.h"
#include "tests/logging/record_fixture.h"

namespace poise::logging {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class DriveEventsTest : public RecordTest {
 protected:
  DriveEventsTest() { with_drives_ = true; }
  std::vector<std::string> Details(const std::string& name) {
    std::vector<std::string> found;
    for (const Event& event : Events(Read())) {
      if (event.name == name) found.push_back(event.detail);
    }
    return found;
  }
};

TEST_F(DriveEventsTest, AnImpedanceThatIsCutIsToldWithItsSize) {
  for (size_t t = 0; t < kTicks; ++t) {
    bridge_[t].state = bridge_status_t::STATE_RUNNING;
    if (t < 20 || t >= 40) continue;
    bridge_[t].saturated[3] = bridge_status_t::LIMIT_IMPEDANCE;
    command_[t].stiffness[3] = 600.93;
    drive_[t].stiffness[3] = 600;
  }
  EXPECT_THAT(Details("impedance_cut"), IsEmpty()) << "0.15 %";
  for (size_t t = 30; t < 40; ++t) command_[t].stiffness[3] = t == 35 ? 900 : 700;
  const std::string knee = Read().robot.joints()[3].name;
  EXPECT_THAT(Details("impedance_cut"),
              ElementsAre(knee + ": stiffness cut from 900 to 600 N·m/rad"));
  EXPECT_THAT(Details("impedance_cut_ends"), ElementsAre(knee + ", after 0.020 s"));
}

TEST_F(DriveEventsTest, ANegativeStiffnessIsNamed) {
  for (size_t t = 0; t < kTicks; ++t) {
    const bool refused = t >= 50;
    if (refused) command_[t].stiffness[3] = -5;
    bridge_[t].state =
        refused ? bridge_status_t::STATE_STOPPING : bridge_status_t::STATE_RUNNING;
    bridge_[t].reason =
        refused ? bridge_status_t::REASON_COMMAND_NOT_FINITE : bridge_status_t::REASON_NONE;
    bridge_[t].reason_joint = -1;
  }
  EXPECT_THAT(Details("bridge_state"),
              ElementsAre("running to stopping: command not finite, or with a negative stiffness "
                          "or damping (stiffness of " +
                          Read().robot.joints()[3].name + ": -5 N·m/rad)"));
}

TEST_F(DriveEventsTest, ASoleThatTipsIsToldWithALoadThatLasts) {
  const robot::RobotModel robot = Read().robot;
  const double half = 0.5 * robot.feet()[1].length, weight = robot.total_mass() * robot::kGravity;
  for (size_t t = 30; t < 70; ++t) {
    const double load = t == 30 ? 30 * weight : weight;
    truth_[t].foot_wrench[1].force[2] = -load;
    truth_[t].foot_wrench[1].moment[1] = half * load;
  }
  EXPECT_THAT(Details("sole_on_edge"),
              ElementsAre(fmt::format("left foot, which carried {:.0f} N", weight)));
}

}  // namespace
}  // namespace poise::logging
