// An operator's acts: in their tick or not at all, answered, whatever arrives.
#include "components/framework/operator_acts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "components/framework/bus/inbox.h"
#include "components/framework/run.h"
#include "tests/framework/toy_components.h"
#include "tests/test_seed.h"

namespace poise::operator_acts {
namespace {

using operate::act_t;
using operate::answer_t;

constexpr int64_t kRun = 77;
constexpr int kMe = 3;

Tick At(int64_t index) { return MakeTick(index, 0.002); }

act_t Act(int64_t id, int64_t tick, int8_t kind = act_t::KIND_STEP) {
  act_t act{};
  act.run_id = kRun;
  act.id = id;
  act.tick = tick;
  act.component = kMe;
  act.kind = kind;
  return act;
}

act_t Setting(int64_t id, int64_t tick, const std::string& field, double value) {
  act_t act = Act(id, tick, act_t::KIND_SETTING);
  std::copy(field.begin(), field.end(), act.field);
  act.value = value;
  return act;
}

std::vector<answer_t> Answers(ActInput* input) {
  std::vector<answer_t> answers;
  answer_t answer;
  while (input->TakeAnswer(&answer)) answers.push_back(answer);
  return answers;
}

class OperatorActsTest : public testing::Test {
 protected:
  OperatorActsTest() { input_.SetAddress(kMe); }
  /// Ids that take effect in this tick.
  std::vector<int64_t> Run(int64_t tick, int8_t verdict = answer_t::VERDICT_DONE) {
    std::vector<int64_t> ids;
    while (const act_t* const act = input_.Next(At(tick))) {
      ids.push_back(act->id);
      input_.Answer(verdict);
    }
    return ids;
  }
  ActInput input_;
};

using Ids = std::vector<int64_t>;

TEST_F(OperatorActsTest, TakeEffectInTheirTickWhateverOrderTheyCameIn) {
  for (const auto& [id, tick] : {std::pair{5, 7}, {4, 3}, {9, 3}, {2, 3}}) {
    input_.Offer(Act(id, tick));
  }
  for (int64_t tick = 0; tick < 10; ++tick) {
    EXPECT_EQ(Run(tick), tick == 3 ? Ids({2, 4, 9}) : tick == 7 ? Ids({5}) : Ids()) << tick;
  }
  const std::vector<answer_t> answers = Answers(&input_);
  ASSERT_EQ(answers.size(), 4u);
  for (const answer_t& answer : answers) {
    EXPECT_EQ(answer.verdict, answer_t::VERDICT_DONE);
    EXPECT_EQ(answer.tick, answer.id == 5 ? 7 : 3);
    EXPECT_EQ(answer.component, kMe);
    EXPECT_EQ(answer.run_id, kRun);
  }
}

TEST_F(OperatorActsTest, WhatIsLateFarOrTooMuchHasNoEffect) {
  for (int64_t tick = 0; tick <= 100; ++tick) Run(tick);
  input_.Offer(Act(1, 100));
  input_.Offer(Act(2, 0));
  input_.Offer(Act(3, std::numeric_limits<int64_t>::min()));
  input_.Offer(Act(4, std::numeric_limits<int64_t>::max()));
  std::vector<answer_t> answers = Answers(&input_);
  ASSERT_EQ(answers.size(), 4u);
  for (const answer_t& answer : answers) {
    EXPECT_EQ(answer.verdict, answer.id == 4 ? answer_t::VERDICT_FAR : answer_t::VERDICT_LATE);
  }
  for (int64_t id = 10; id < 110; ++id) input_.Offer(Act(id, 200));
  answers = Answers(&input_);
  for (const answer_t& answer : answers) EXPECT_EQ(answer.verdict, answer_t::VERDICT_FULL);
  EXPECT_EQ(Run(200).size() + answers.size(), 100u);
  EXPECT_GE(answers.size(), 1u);
}

TEST_F(OperatorActsTest, TheSameActAgainHasNoSecondEffectButIsAnsweredAgain) {
  for (int i = 0; i < 3; ++i) input_.Offer(Act(6, 1));
  Run(0);
  EXPECT_EQ(Run(1, answer_t::VERDICT_NOT_NOW), Ids({6}));
  EXPECT_EQ(Answers(&input_).size(), 1u);
  input_.Offer(Act(6, 5));
  const std::vector<answer_t> again = Answers(&input_);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].verdict, answer_t::VERDICT_NOT_NOW);
  EXPECT_EQ(again[0].tick, 1);
  for (int64_t tick = 2; tick < 8; ++tick) EXPECT_EQ(Run(tick), Ids());
}

TEST_F(OperatorActsTest, AnothersActIsNotAnswered) {
  act_t act = Act(1, 3);
  act.component = kMe + 1;
  input_.Offer(act);
  EXPECT_EQ(Run(3), Ids());
  EXPECT_TRUE(Answers(&input_).empty());
}

TEST_F(OperatorActsTest, ASettingGoesToItsValueInAStraightLine) {
  double gain = 10;
  input_.settings() = LiveSettings(0.002);
  input_.settings().Add("com.kp", &gain, 5, 50, 0.1);  // 50 ticks
  input_.Offer(Setting(1, 20, "com.kp", 30));
  for (int64_t tick = 0; tick < 120; ++tick) {
    Run(tick);
    const bool changed = input_.settings().Advance(tick);
    const double share = std::clamp(static_cast<double>(tick - 19) / 50, 0.0, 1.0);
    EXPECT_NEAR(gain, 10 + 20 * share, 1e-12) << tick;
    EXPECT_EQ(changed, tick >= 20 && tick < 70) << tick;
  }
  EXPECT_EQ(gain, 30);
}

TEST_F(OperatorActsTest, ASettingOutOfRangeOrUnknownStays) {
  double gain = 10;
  input_.settings() = LiveSettings(0.002);
  input_.settings().Add("kp", &gain, 5, 50, 0);
  input_.Offer(Setting(1, 1, "kp", 4.999));
  input_.Offer(Setting(2, 1, "kp", 50.001));
  input_.Offer(Setting(3, 1, "kpp", 20));
  input_.Offer(Setting(4, 1, "", 20));
  input_.Offer(Setting(5, 1, "k", 20));
  act_t unended = Setting(6, 1, "kp", 20);
  std::fill(std::begin(unended.field), std::end(unended.field), int8_t{'x'});
  input_.Offer(unended);
  for (int64_t tick = 0; tick < 5; ++tick) {
    Run(tick);
    EXPECT_FALSE(input_.settings().Advance(tick));
  }
  EXPECT_EQ(gain, 10);
  for (const answer_t& answer : Answers(&input_)) {
    EXPECT_EQ(answer.verdict, answer.id <= 2 ? answer_t::VERDICT_RANGE : answer_t::VERDICT_UNKNOWN);
  }
  input_.Offer(Setting(7, 9, "kp", 20));
  act_t ask = Setting(8, 0, "kp", 0);
  ask.kind = act_t::KIND_ASK;
  input_.Offer(ask);
  const std::vector<answer_t> asked = Answers(&input_);
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].value, 10);
}

TEST_F(OperatorActsTest, AStateInTheMiddleOfAChangeGoesOnWithTheSameBits) {
  double gain = 10, other = 10;
  input_.settings() = LiveSettings(0.002);
  input_.settings().Add("kp", &gain, 5, 50, 0.1);
  ActInput successor;
  successor.settings() = LiveSettings(0.002);
  successor.settings().Add("kp", &other, 5, 50, 0.1);
  input_.Offer(Setting(1, 3, "kp", 31.7));
  for (int64_t tick = 0; tick < 20; ++tick) {
    Run(tick);
    input_.settings().Advance(tick);
  }
  std::vector<uint8_t> bytes(4096);
  StateArchive save = StateArchive::Saving(bytes);
  input_.Archive(&save);
  ASSERT_TRUE(save.ok());
  StateArchive restore = StateArchive::Restoring(bytes);
  successor.Archive(&restore);
  for (int64_t tick = 20; tick < 70; ++tick) {
    input_.settings().Advance(tick);
    successor.settings().Advance(tick);
    ASSERT_EQ(gain, other) << tick;
  }
  EXPECT_EQ(other, 31.7);
}

std::vector<uint8_t> Encode(const act_t& act) {
  std::vector<uint8_t> bytes(static_cast<size_t>(act.getEncodedSize()));
  act.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

TEST_F(OperatorActsTest, HostilePacketsAndAFloodChangeNothingAndAllocateNothing) {
  double gain = 10;
  input_.settings() = LiveSettings(0.002);
  input_.settings().Add("kp", &gain, 5, 50, 0.1);
  Wiring wiring;
  wiring.AddInput(&input_, "operator", {}, InputKind::kLatest);
  Inbox inbox(&input_, kRun);
  std::mt19937_64 random(TestSeed(18));
  const std::vector<uint8_t> right = Encode(Setting(1, 5, "kp", 20));
  std::vector<std::vector<uint8_t>> packets;
  for (int i = 0; i < 3000; ++i) {
    std::vector<uint8_t> bytes = right;
    const size_t from = i % 3 == 0 ? 8 : i % 3 == 1 ? 24 : 0;  // after fingerprint, run and tick
    for (size_t n = 0; n < 1 + random() % 40; ++n) {
      bytes[from + random() % (bytes.size() - from)] = static_cast<uint8_t>(random());
    }
    if (i % 7 == 0) bytes.resize(random() % (2 * bytes.size()));
    packets.push_back(bytes);
  }
  const double before = gain;
  const int64_t allocations = AllocationCount();
  int64_t answers = 0;
  answer_t answer;
  for (size_t i = 0; i < packets.size(); ++i) {
    inbox.Offer(packets[i].data(), packets[i].size());
    const Tick tick = At(static_cast<int64_t>(i));
    while (input_.Next(tick) != nullptr) input_.Answer(answer_t::VERDICT_UNKNOWN);
    input_.settings().Advance(tick.index);
    while (input_.TakeAnswer(&answer)) ++answers;
    ASSERT_TRUE(gain >= 5 && gain <= 50);
  }
  EXPECT_EQ(AllocationCount(), allocations);
  EXPECT_LE(answers, static_cast<int64_t>(packets.size()));
  EXPECT_GT(inbox.counters().refused(), 500);
  // Not finite: refused before it is looked at.
  act_t bad = Setting(99, 5000, "kp", std::nan(""));
  const std::vector<uint8_t> bytes = Encode(bad);
  inbox.Offer(bytes.data(), bytes.size());
  EXPECT_EQ(inbox.counters().count(PacketVerdict::kNotFinite) > 0, true);
  EXPECT_GE(before, 5);
}

}  // namespace
}  // namespace poise::operator_acts
