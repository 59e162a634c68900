#include "lcmtypes/field_table.h"

#include <gtest/gtest.h>

#include <string>

#include "poise/message_traits.hpp"

namespace poise {
namespace {

TEST(FieldTable, UnitsAreThoseOfTheComments) {
  EXPECT_EQ(UnitOf("robot_state_t", "base_linear_velocity[2]"), "m/s");
  EXPECT_EQ(UnitOf("robot_sensors_t", "joint_position[7]"), "rad");
  EXPECT_EQ(UnitOf("robot_sensors_t", "imu_acceleration[0]"), "m/s^2");
  EXPECT_EQ(UnitOf("joint_command_t", "torque[right_knee_pitch]"), "N·m");
  EXPECT_EQ(UnitOf("joint_command_t", "foot_wrench[left].force[2]"), "N");
  EXPECT_EQ(UnitOf("joint_command_t", "foot_wrench[1].moment[0]"), "N·m");
  EXPECT_EQ(UnitOf("planner_status_t", "step_time"), "s");      // "s from now, by when"
  EXPECT_EQ(UnitOf("bridge_status_t", "thermal_load[0]"), "");  // "share of ..."
  EXPECT_EQ(UnitOf("bridge_status_t", "no_such_field"), "");
  EXPECT_EQ(UnitOf("no_such_t", "torque"), "");
}

TEST(FieldTable, HasTheFieldsOfEveryMessageInOrder) {
  ForEachMessageType([]<class T>() {
    const std::span<const FieldInfo> fields = FieldsOf(MessageTraits<T>::kName);
    size_t next = 0;
    T message{};
    MessageTraits<T>::VisitFields(message, [&](const char* name, const auto& member) {
      ASSERT_LT(next, fields.size());
      EXPECT_STREQ(fields[next].name, name);
      const bool sized = message_internal::IsVector<std::remove_cvref_t<decltype(member)>>::value;
      EXPECT_EQ(std::string(fields[next].count).starts_with("num_"), sized) << name;
      ++next;
    });
    EXPECT_EQ(next, fields.size());
  });
}

}  // namespace
}  // namespace poise
