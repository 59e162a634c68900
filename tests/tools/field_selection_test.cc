// Fields by path, of messages that liblcm itself encodes.
#include "tools/live/field_selection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "components/framework/configuration/configuration.h"
#include "poise/balance_torque_t.hpp"
#include "poise/health_t.hpp"
#include "tests/logging/log_test_support.h"

namespace poise {
namespace {

using logging::Encode;
using ::testing::ElementsAre;

const MessageType& Balance() { return *FindMessageType("balance_torque_t"); }

balance_torque_t SampleMessage() {
  balance_torque_t message;
  MessageTraits<balance_torque_t>::Resize(message, std::array<int32_t, 2>{3, 2});
  message.tick = 7;
  message.torque = {1.5, -2, 3};
  message.foot_wrench[1].force[2] = -250;
  message.foot_wrench[1].moment[0] = 4;
  return message;
}

std::vector<Scalar> Scalars() { return ReadScalars(Balance(), Encode(SampleMessage())).value(); }

std::vector<std::string> Paths(const std::vector<Scalar>& scalars) {
  std::vector<std::string> paths;
  for (const Scalar& scalar : scalars) paths.push_back(scalar.path);
  return paths;
}

std::string ProblemWith(const std::string& field) {
  try {
    FieldSelection({field}).Check(Balance(), Scalars());
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), field);
    return error.problem();
  }
  return "";
}

TEST(FieldSelectionTest, PicksScalarsArraysAndGroupsInTheOrderAskedFor) {
  const FieldSelection selection({"foot_wrench[1]", "torque[1]", "tick", "torque"});
  selection.Check(Balance(), Scalars());
  const std::vector<Scalar> picked = selection.Pick(Scalars());
  EXPECT_THAT(Paths(picked),
              ElementsAre("foot_wrench[1].force[0]", "foot_wrench[1].force[1]",
                          "foot_wrench[1].force[2]", "foot_wrench[1].moment[0]",
                          "foot_wrench[1].moment[1]", "foot_wrench[1].moment[2]", "torque[1]",
                          "tick", "torque[0]", "torque[1]", "torque[2]"));
  EXPECT_EQ(std::get<double>(picked[2].value), -250);
  EXPECT_EQ(std::get<double>(picked[3].value), 4);
  EXPECT_EQ(std::get<double>(picked[6].value), -2);
  EXPECT_EQ(std::get<int64_t>(picked[7].value), 7);
}

TEST(FieldSelectionTest, NothingAskedForIsTheWholeMessage) {
  const FieldSelection selection({});
  selection.Check(Balance(), Scalars());
  // 5 of the header, 2 x 3 torques, 2 contacts, 3 states, a pose (7), 3 x 2 of the centre of
  // pressure, 2 + 2 wrenches (6), 5 margins, region and 16 corners of it.
  EXPECT_EQ(selection.Pick(Scalars()).size(), 5u + 6 + 2 + 3 + 7 + 6 + 24 + 5 + 2 + 32);
}

TEST(FieldSelectionTest, ANameIsNotTheBeginningOfAnother) {
  EXPECT_THAT(Paths(FieldSelection({"resultant"}).Pick(Scalars())).front(), "resultant.force[0]");
  EXPECT_EQ(FieldSelection({"resultant"}).Pick(Scalars()).size(), 6u);
}

TEST(FieldSelectionTest, SaysWhatAFieldMayHaveBeen) {
  EXPECT_EQ(ProblemWith("torqe"), "balance_torque_t has no field 'torqe'; did you mean torque?");
  EXPECT_EQ(ProblemWith("torque[3]"),
            "torque is an array of 3; write torque[0] to torque[2] or torque");
  EXPECT_EQ(ProblemWith("foot_wrench.force"),
            "foot_wrench is an array of 2; write foot_wrench[0] to foot_wrench[1] or foot_wrench");
  EXPECT_EQ(ProblemWith("foot_wrench[0].forse"),
            "foot_wrench[0] has no field 'forse'; did you mean force?");
  EXPECT_EQ(ProblemWith("frame_o[0]"),
            "frame_o has no field '[0]'; use one of orientation, position");
  EXPECT_EQ(ProblemWith("tick.x"), "tick is a single value; leave out '.x'");
  EXPECT_EQ(ProblemWith("torque[1]."), "torque[1] is a single value; leave out '.'");
}

TEST(FieldSelectionTest, JointsAndFeetHaveTheirNames) {
  const logging::ElementNames names = logging::ElementNames::OfSpec(logging::MakeTestSpec());
  const std::vector<Scalar> scalars =
      ReadScalars(Balance(), Encode(SampleMessage()), names).value();
  const auto picked = [&](const std::string& field) {
    FieldSelection selection({field});
    selection.UseNames(Balance(), names);
    selection.Check(Balance(), scalars);
    return Paths(selection.Pick(scalars));
  };
  const std::string joint = "torque[" + names.Of("balance_torque_t", "torque").at(1) + "]";
  EXPECT_THAT(picked(joint), ElementsAre(joint));
  EXPECT_THAT(picked("torque[1]"), ElementsAre(joint));
  EXPECT_THAT(picked("foot_wrench[left].force[2]"), ElementsAre("foot_wrench[left].force[2]"));
  EXPECT_THAT(picked("foot_wrench[left_foot].force[2]"), ElementsAre("foot_wrench[left].force[2]"));
  const auto problem = [&](const std::string& field) -> std::string {
    try {
      picked(field);
    } catch (const ConfigError& error) {
      return error.problem();
    }
    return "";
  };
  EXPECT_EQ(problem("foot_wrench[rihgt]"),
            "foot_wrench has no element 'rihgt'; did you mean right?");
  EXPECT_EQ(problem("torque[roll]"), "torque has no element 'roll'; use one of right_hip_roll");
  EXPECT_EQ(problem("foot_wrench[2]"), "foot_wrench has no element '2'; use one of left, right");
  EXPECT_EQ(problem("foot_wrench.force"),
            "foot_wrench is an array of 2; write foot_wrench[right] to foot_wrench[left] or "
            "foot_wrench");
}

TEST(FieldSelectionTest, OddTextsAreNoFields) {
  for (const char* field :
       {"", ".", "[", "[[", "..", "torque[", "torque[]", "torque[1", "torque[-1]", "torque[1]]",
        "torque.", ".torque", "torque[01]", "\n", "\xff"}) {
    EXPECT_NE(ProblemWith(field), "") << field;
  }
}

TEST(FieldSelectionTest, AZeroMessageHasTheFieldsOfARealOne) {
  for (const MessageType& type : MessageTypes()) {
    if (type.has_strings) continue;
    const std::vector<int32_t> counts(type.count_names.size(), 2);
    const std::vector<uint8_t> bytes = ZeroMessage(type, counts);
    ASSERT_TRUE(ReadScalars(type, bytes).has_value()) << type.name;
  }
  const std::vector<uint8_t> bytes = ZeroMessage(Balance(), std::array<int32_t, 2>{3, 2});
  EXPECT_EQ(Paths(ReadScalars(Balance(), bytes).value()), Paths(Scalars()));
}

TEST(FieldSelectionTest, DamagedMessagesAreNone) {
  std::vector<uint8_t> bytes = Encode(SampleMessage());
  bytes.pop_back();
  EXPECT_FALSE(ReadScalars(Balance(), bytes).has_value());
  bytes = Encode(SampleMessage());
  bytes.push_back(0);
  EXPECT_FALSE(ReadScalars(Balance(), bytes).has_value());
  bytes = Encode(SampleMessage());
  bytes[8] = 0x7f;  // 2 billion joints
  EXPECT_FALSE(ReadScalars(Balance(), bytes).has_value());
  bytes = Encode(SampleMessage());
  bytes[0] ^= 1;  // fingerprint
  EXPECT_FALSE(ReadScalars(Balance(), bytes).has_value());
  EXPECT_FALSE(ReadScalars(Balance(), {}).has_value());
  EXPECT_FALSE(ReadScalars(*FindMessageType("health_t"), Encode(SampleMessage())).has_value());
}

}  // namespace
}  // namespace poise
