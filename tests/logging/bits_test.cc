#include "logging/replay/bits.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "logging/log_reader.h"
#include "poise/message_traits.hpp"
#include "poise/robot_state_t.hpp"
#include "tests/logging/log_test_support.h"

namespace poise::logging {
namespace {

constexpr int64_t kBitsTicks = 40;

class BitsTest : public testing::Test {
 protected:
  /// The bits of a log of ROBOT_STATE, after `change` of its messages.
  std::vector<ChannelBits> Bits(const std::function<void(std::vector<robot_state_t>*)>& change) {
    std::vector<robot_state_t> states(kBitsTicks);
    for (int64_t t = 0; t < kBitsTicks; ++t) {
      robot_state_t& state = states[static_cast<size_t>(t)];
      MessageTraits<robot_state_t>::Resize(state, std::vector<int32_t>{12, 2});
      SetHeader(t, &state);
      state.base_position[2] = 0.1 * static_cast<double>(t);
    }
    change(&states);
    std::vector<RawEvent> events = {RunInfoEvent(MakeTestSpec())};
    for (const robot_state_t& state : states) {
      events.push_back({"ROBOT_STATE", state.utime, Encode(state)});
    }
    WriteRawLog(folder_.path("log"), events);
    return BitsOfLog(folder_.path("log"));
  }
  std::vector<ChannelBits> Bits() {
    return Bits([](std::vector<robot_state_t>*) {});
  }

  TemporaryFolder folder_;
};

const ChannelBits& RobotState(const std::vector<ChannelBits>& bits) {
  return *std::find_if(bits.begin(), bits.end(),
                       [](const ChannelBits& each) { return each.name == "ROBOT_STATE"; });
}

TEST_F(BitsTest, ALastBitIsNamedByItsTick) {
  const std::vector<ChannelBits> recorded = Bits();
  EXPECT_EQ(RobotState(recorded).by_tick.size(), static_cast<size_t>(kBitsTicks));
  // The check sum's byte hides one change in 256: of all ticks a few at most are named late.
  int late = 0;
  for (int64_t tick = 0; tick < kBitsTicks; ++tick) {
    const auto difference =
        FirstDifference(recorded, Bits([&](auto* states) {
                          double& z = (*states)[static_cast<size_t>(tick)].base_position[2];
                          z = std::nextafter(z, 10);
                        }));
    ASSERT_TRUE(difference) << tick;
    EXPECT_EQ(difference->channel, "ROBOT_STATE");
    late += difference->tick == tick ? 0 : 1;
  }
  EXPECT_LE(late, 2);
}

TEST_F(BitsTest, RunIdAloneIsNoDifference) {
  EXPECT_FALSE(FirstDifference(Bits(), Bits([](auto* states) {
                                 for (robot_state_t& state : *states) state.run_id = 77;
                               })));
}

TEST_F(BitsTest, AShorterRunLacksATick) {
  const auto difference = FirstDifference(Bits(), Bits([](auto* states) { states->pop_back(); }));
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->tick, kBitsTicks - 1);
  EXPECT_EQ(difference->what, "the run lacks it");
}

TEST_F(BitsTest, ALogWithAGapIsRefused) {
  EXPECT_THROW(Bits([](auto* states) { states->erase(states->begin() + 3); }), LogError);
}

TEST_F(BitsTest, TheRecordIsReadBack) {
  const std::vector<ChannelBits> bits = Bits();
  const nlohmann::json json = BitsJson(bits);
  EXPECT_FALSE(FirstDifference(bits, ParseBits(json, BitsBytes(bits))));
  EXPECT_THROW(ParseBits(json, BitsBytes(bits) + "x"), LogError);
  EXPECT_THROW(ParseBits(json, BitsBytes(bits).substr(1)), LogError);
  nlohmann::json broken = json;
  const auto line = json.back().get<std::string>();
  for (const std::string& other :
       {"xyz" + line.substr(3), line.substr(0, line.find(' ')), line + " more", std::string()}) {
    broken.back() = other;
    EXPECT_THROW(ParseBits(broken, BitsBytes(bits)), LogError) << other;
  }
  broken.back() = 1;
  EXPECT_THROW(ParseBits(broken, BitsBytes(bits)), LogError);
}

}  // namespace
}  // namespace poise::logging
