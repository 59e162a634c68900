// The ticks of a run in progress, from messages that come late, not at all, or with hostile ticks.
#include "tools/live/tick_ring.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "components/framework/run.h"
#include "poise/external_push_t.hpp"
#include "tests/logging/log_test_support.h"
#include "tools/live/field_selection.h"

namespace poise {
namespace {

using ::testing::ElementsAre;
using Bytes = std::vector<uint8_t>;

constexpr int64_t kCapacity = 20;

class TickRingTest : public ::testing::Test {
 protected:
  void SetUp() override {
    spec.set_num_ticks(0);  // no planned end
    for (int i = 0; i < spec.graph().channel_size(); ++i) {
      if (!spec.graph().channel(i).external()) dense.push_back(i);
      if (spec.graph().channel(i).name() == "EXTERNAL_PUSH") push = i;
    }
    ASSERT_GE(push, 0);
  }
  /// A message of zeros; one of EXTERNAL_PUSH has `value` as its force along x.
  void Add(TickRing* ring, int channel, int64_t tick, double value = 0) {
    const Channel& c = spec.graph().channel(channel);
    const MessageType* type = FindMessageType(c.type());
    Bytes bytes = ZeroMessage(*type, std::vector<int32_t>(c.count().begin(), c.count().end()));
    if (channel == push) {
      external_push_t message{};
      logging::SetHeader(tick, &message);
      message.force[0] = value;
      bytes = logging::Encode(message);
    }
    ring->Add({c.name(), channel, type, tick, bytes});
  }
  void AddTick(TickRing* ring, int64_t tick) {
    for (const int channel : dense) Add(ring, channel, tick, static_cast<double>(tick));
  }
  /// EXTERNAL_PUSH.force[0] of the ticks held, read from a batch as docs/reference/report_format.md
  /// has it.
  std::vector<double> Pushes(const TickRing& ring) {
    const int64_t count = ring.end_tick() - ring.first_tick();
    const std::string batch = ring.Encode(ring.first_tick(), ring.end_tick(), 7.5);
    size_t integers = 0;
    size_t reals = 0;
    size_t place = 0;
    for (const TickRing::Lane& lane : ring.lanes()) {
      for (const TickRing::Signal& signal : lane.signals) {
        if (lane.name == "EXTERNAL_PUSH" && signal.field == "force[0]") place = reals;
        ++(signal.integer ? integers : reals);
      }
    }
    const auto rows = static_cast<size_t>(count);
    EXPECT_EQ(batch.size(), 32 + rows * (8 * integers + 4 * reals));
    uint32_t head[2];
    double times[3];  // first tick, end, time
    std::memcpy(head, batch.data(), 8);
    std::memcpy(times, batch.data() + 8, 24);
    EXPECT_EQ(head[0], 2u);
    EXPECT_EQ(head[1], rows);
    EXPECT_EQ(times[0], static_cast<double>(ring.first_tick()));
    EXPECT_EQ(times[1], static_cast<double>(ring.end_tick()));
    EXPECT_EQ(times[2], 7.5);
    std::vector<double> values;
    for (size_t i = 0; i < rows; ++i) {
      float value = 0;
      std::memcpy(&value, batch.data() + 32 + 8 * rows * integers + 4 * (rows * place + i), 4);
      values.push_back(value);
    }
    return values;
  }

  RunSpec spec = logging::MakeTestSpec();
  std::vector<int> dense;
  int push = -1;
};

TEST_F(TickRingTest, TakesATickWhenAllChannelsHaveIt) {
  TickRing ring(spec, kCapacity);
  for (const int channel : dense) {
    EXPECT_EQ(ring.end_tick(), 0);
    Add(&ring, channel, 0, 3);
  }
  EXPECT_EQ(ring.end_tick(), 1);
  AddTick(&ring, 1);
  AddTick(&ring, 2);
  EXPECT_THAT(Pushes(ring), ElementsAre(3, 1, 2));
  EXPECT_EQ(ring.lost(), 0);
}

TEST_F(TickRingTest, KeepsTheLastTicks) {
  TickRing ring(spec, kCapacity);
  for (int64_t tick = 0; tick < 1000; ++tick) AddTick(&ring, tick);
  EXPECT_EQ(ring.first_tick(), 1000 - kCapacity);
  EXPECT_EQ(ring.end_tick(), 1000);
  const std::vector<double> pushes = Pushes(ring);
  for (size_t i = 0; i < pushes.size(); ++i) {
    EXPECT_EQ(pushes[i], static_cast<double>(ring.first_tick()) + static_cast<double>(i));
  }
}

TEST_F(TickRingTest, BeginsWithTheFirstWholeTickOfWhoComesLate) {
  TickRing ring(spec, 2 * kMaxLead);
  Add(&ring, dense.back(), 70);
  for (const int channel : dense) {
    if (channel != push) Add(&ring, channel, 71);
  }
  for (int64_t tick = 72; tick <= 71 + kMaxLead; ++tick) AddTick(&ring, tick);
  EXPECT_EQ(ring.end_tick(), 72 + kMaxLead);
  EXPECT_EQ(ring.first_tick(), 72);
  EXPECT_EQ(Pushes(ring).front(), 72);
  EXPECT_EQ(ring.lost(), 0);
}

TEST_F(TickRingTest, GoesOnWithoutWhatIsLost) {
  TickRing ring(spec, 2 * kMaxLead);
  for (int64_t tick = 0; tick <= 1 + kMaxLead; ++tick) {
    for (const int channel : dense) {
      if (tick != 1 || channel != push) Add(&ring, channel, tick, static_cast<double>(tick));
    }
    if (tick == kMaxLead) {
      EXPECT_EQ(ring.end_tick(), 1);  // it may still come
    }
  }
  EXPECT_EQ(ring.end_tick(), 2 + kMaxLead);
  EXPECT_EQ(ring.lost(), 1);
  const std::vector<double> pushes = Pushes(ring);
  EXPECT_EQ(pushes[0], 0);
  EXPECT_TRUE(std::isnan(pushes[1]));
  EXPECT_EQ(pushes[2], 2);
}

TEST_F(TickRingTest, OneStrayTickMovesNothingAndALongPauseIsPassedOver) {
  TickRing ring(spec, kCapacity);
  AddTick(&ring, 0);
  for (const int64_t tick : {int64_t{-1}, int64_t{1} << 40, INT64_MIN, INT64_MAX}) {
    Add(&ring, dense[0], tick);
    Add(&ring, dense[0], 0);
  }
  AddTick(&ring, 1);
  EXPECT_THAT(Pushes(ring), ElementsAre(0, 1));
  for (int64_t tick = 100000; tick < 100000 + 2 * kMaxLead; ++tick) AddTick(&ring, tick);
  EXPECT_EQ(ring.end_tick(), 100000 + 2 * kMaxLead);
  EXPECT_EQ(Pushes(ring).back(), 99999 + 2 * kMaxLead);
  EXPECT_GT(ring.lost(), 0);
}

TEST_F(TickRingTest, TheEndTakesWhatHasCome) {
  TickRing ring(spec, kCapacity);
  ring.Finish();
  EXPECT_EQ(ring.end_tick(), 0);
  AddTick(&ring, 0);
  Add(&ring, push, 1, 7);
  ring.Finish();
  EXPECT_THAT(Pushes(ring), ElementsAre(0, 7));
}

TEST_F(TickRingTest, NumbersBeyondAFloatAreNone) {
  TickRing ring(spec, kCapacity);
  const double hostile[] = {1e300, -INFINITY, NAN, 5};
  for (int64_t tick = 0; tick < 4; ++tick) {
    for (const int channel : dense) Add(&ring, channel, tick, hostile[tick]);
  }
  const std::vector<double> pushes = Pushes(ring);
  for (size_t i = 0; i < 3; ++i) EXPECT_TRUE(std::isnan(pushes[i])) << i;
  EXPECT_EQ(pushes[3], 5);
}

}  // namespace
}  // namespace poise
