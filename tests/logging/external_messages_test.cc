// Operators' messages stand in the ticks in which the bridge acted on them.
#include "logging/replay/external_messages.h"

#include <gtest/gtest.h>

#include "poise/bridge_status_t.hpp"
#include "poise/emergency_stop_t.hpp"
#include "tests/logging/log_test_support.h"

namespace poise::logging {
namespace {

constexpr int64_t kExternalMessagesTicks = 2000;

class PlaceEmergencyStopsTest : public testing::Test {
 protected:
  /// The bridge's state from `tick` on.
  void SetState(int64_t tick, int8_t state, int8_t reason = bridge_status_t::REASON_OPERATOR) {
    for (; tick < kExternalMessagesTicks; ++tick) {
      statuses_[static_cast<size_t>(tick)].state = state;
      statuses_[static_cast<size_t>(tick)].reason = reason;
    }
  }
  void ResetAt(int64_t tick) {
    SetState(tick, bridge_status_t::STATE_RUNNING, bridge_status_t::REASON_NONE);
    for (; tick < kExternalMessagesTicks; ++tick) ++statuses_[static_cast<size_t>(tick)].resets;
  }
  void Send(int64_t recorded, bool stop, bool reset = false) {
    emergency_stop_t message{};
    message.stop = stop ? 1 : 0;
    message.reset = reset ? 1 : 0;
    bytes_.push_back(Encode(message));
    recorded_.push_back(recorded);
  }
  std::vector<ExternalMessage> Place() {
    Series<std::span<const uint8_t>> series;
    std::vector<std::vector<uint8_t>> encoded;
    for (int64_t tick = 0; tick < kExternalMessagesTicks; ++tick) {
      SetHeader(tick, &statuses_[static_cast<size_t>(tick)]);
      encoded.push_back(Encode(statuses_[static_cast<size_t>(tick)]));
    }
    for (int64_t tick = 0; tick < kExternalMessagesTicks; ++tick) {
      if (tick != lost_) series.Set(tick, encoded[static_cast<size_t>(tick)]);
    }
    std::vector<ExternalMessage> messages;
    for (size_t i = 0; i < bytes_.size(); ++i) messages.push_back({recorded_[i], false, bytes_[i]});
    PlaceEmergencyStops(series, &messages);
    return messages;
  }

  std::vector<bridge_status_t> statuses_ = std::vector<bridge_status_t>(kExternalMessagesTicks);
  std::vector<std::vector<uint8_t>> bytes_;
  std::vector<int64_t> recorded_;
  int64_t lost_ = -1;  // tick without a status
};

TEST_F(PlaceEmergencyStopsTest, AStopStandsWhereTheStateChanges) {
  SetState(0, bridge_status_t::STATE_RUNNING, bridge_status_t::REASON_NONE);
  SetState(700, bridge_status_t::STATE_ESTOP);
  for (const int64_t recorded : {500, 690, 700, 701, 900}) {
    bytes_.clear();
    recorded_.clear();
    Send(recorded, true);
    Send(recorded + 3, true);  // repeated until it is confirmed
    const std::vector<ExternalMessage> messages = Place();
    EXPECT_EQ(messages[0].tick, 700) << recorded;
    EXPECT_TRUE(messages[0].certain);
    EXPECT_GE(messages[1].tick, 700);
    EXPECT_TRUE(messages[1].certain);
  }
}

TEST_F(PlaceEmergencyStopsTest, AStopInTheFirstTick) {
  SetState(0, bridge_status_t::STATE_ESTOP);
  Send(12, true);
  EXPECT_EQ(Place()[0].tick, 0);
}

TEST_F(PlaceEmergencyStopsTest, StopsAndResetsKeepTheirOrder) {
  SetState(0, bridge_status_t::STATE_RUNNING, bridge_status_t::REASON_NONE);
  SetState(300, bridge_status_t::STATE_ESTOP);
  ResetAt(500);
  SetState(520, bridge_status_t::STATE_ESTOP);
  Send(290, true);
  Send(480, false);
  Send(512, false, true);
  Send(513, false);
  Send(490, true);  // recorded out of order
  const std::vector<ExternalMessage> messages = Place();
  EXPECT_EQ(messages[0].tick, 300);
  EXPECT_LE(messages[1].tick, 500);
  EXPECT_EQ(messages[2].tick, 500);
  EXPECT_GE(messages[3].tick, 500);
  EXPECT_EQ(messages[4].tick, 520);
  for (size_t i = 1; i < messages.size(); ++i) EXPECT_LE(messages[i - 1].tick, messages[i].tick);
}

TEST_F(PlaceEmergencyStopsTest, WhatTheBridgeDoesNotTellStaysUncertain) {
  SetState(0, bridge_status_t::STATE_RUNNING, bridge_status_t::REASON_NONE);
  SetState(700, bridge_status_t::STATE_ESTOP);
  Send(1500, true);  // no one was so far behind: the stop at 700 is another's
  EXPECT_EQ(Place()[0].tick, 1500);
  EXPECT_TRUE(Place()[0].certain);  // the bridge had long stopped
  recorded_[0] = 200;
  EXPECT_EQ(Place()[0].tick, 200);
  EXPECT_FALSE(Place()[0].certain);
  recorded_[0] = 710;
  lost_ = 699;  // whether it stopped in 699 or in 700 is lost
  EXPECT_EQ(Place()[0].tick, 710);
  EXPECT_FALSE(Place()[0].certain);
  lost_ = -1;
  SetState(700, bridge_status_t::STATE_ESTOP, bridge_status_t::REASON_DRIVE_STO);
  EXPECT_FALSE(Place()[0].certain);
  bytes_.clear();
  Send(710, false, true);  // a reset that was not granted
  EXPECT_FALSE(Place()[0].certain);
  bytes_.clear();
  bytes_.push_back({1, 2, 3});
  EXPECT_FALSE(Place()[0].certain);
}

TEST_F(PlaceEmergencyStopsTest, MessagesWithoutEffectAreCertain) {
  SetState(0, bridge_status_t::STATE_RUNNING, bridge_status_t::REASON_NONE);
  Send(100, false);
  const std::vector<ExternalMessage> messages = Place();
  EXPECT_EQ(messages[0].tick, 100);
  EXPECT_TRUE(messages[0].certain);
}

}  // namespace
}  // namespace poise::logging
