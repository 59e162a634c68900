// Every undamaged record of a damaged log is recovered.
#include <gtest/gtest.h>

#include "logging/log_survey.h"
#include "tests/logging/damage_trial.h"
#include "tests/logging/small_log.h"
#include "tests/test_seed.h"

namespace poise::logging {
namespace {

constexpr int64_t kDamageRecoveryTicks = 2000;
constexpr int kTrials = 8;  // log_damage_report does more

class DamageRecoveryTest : public testing::Test {
 protected:
  DamageRecoveryTest() {
    WriteRawLog(path_, SmallLog(kDamageRecoveryTicks));
    whole_ = ReadBytes(path_);
  }
  void Expect(const std::string& damaged) {
    const DamageTrial trial = TryDamage(whole_, damaged, path_);
    EXPECT_EQ(trial.records, 2 * kDamageRecoveryTicks + 2);
    EXPECT_EQ(trial.by_poise, trial.undamaged);
    EXPECT_LE(trial.by_liblcm, trial.undamaged);
    lost_ += trial.records - trial.undamaged;
    SurveyLog(path_).Problems(0);  // whatever it says
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path("log");
  std::string whole_;
  std::mt19937 random_{TestSeed(11)};
  int64_t lost_ = 0;
};

TEST_F(DamageRecoveryTest, CutAnywhere) {
  for (int i = 0; i < kTrials; ++i) Expect(CutAnywhere(whole_, &random_));
  EXPECT_GT(lost_, kTrials);
}

TEST_F(DamageRecoveryTest, OverwrittenAtAThousandPlaces) {
  for (int i = 0; i < kTrials; ++i) Expect(Overwrite(whole_, 1000, &random_));
  EXPECT_GT(lost_, 500 * kTrials);
}

TEST_F(DamageRecoveryTest, LengthAndNumberOfARecordDamagedTogether) {
  const std::vector<RawEvent> events = SmallLog(kDamageRecoveryTicks);
  for (size_t index = 5; index < 25; ++index) {
    std::string damaged = whole_;
    const size_t at = RecordOffset(events, index);
    for (size_t i = 4; i < 12; ++i) damaged[at + i] = static_cast<char>(random_());  // number
    damaged[at + 25] = static_cast<char>(1 + random_() % 15);  // length: up to 1 MB more
    Expect(damaged);
  }
}

}  // namespace
}  // namespace poise::logging
