// When a foot that is to carry counts as lost.
#include "components/step_planner/contact/contact_loss.h"

#include <gtest/gtest.h>

namespace poise {
namespace {

constexpr double kTick = 0.002;

class ContactLossTest : public testing::Test {
 protected:
  /// True when it is lost after so many ticks more.
  bool Hold(double load, int ticks, bool carries = true) {
    for (int i = 0; i < ticks; ++i) loss_.Update(kTick * tick_++, load, carries);
    return loss_.lost();
  }

  ContactLoss loss_{4};  // below 4 N for 0.1 s
  int tick_ = 0;
};

TEST_F(ContactLossTest, TakesALoadThatStaysAway) {
  EXPECT_FALSE(Hold(200, 100));
  EXPECT_FALSE(Hold(3.9, 50));  // 0.1 s are fifty periods: 51 readings
  EXPECT_TRUE(Hold(3.9, 1));
  EXPECT_TRUE(Hold(-1, 100));
  EXPECT_FALSE(Hold(4, 1));  // back again
}

TEST_F(ContactLossTest, AFootThatRattlesIsNotLost) {
  for (int i = 0; i < 20; ++i) {
    EXPECT_FALSE(Hold(0, 50));
    EXPECT_FALSE(Hold(5, 1));
  }
}

TEST_F(ContactLossTest, AFootThatIsNotToCarryIsNotLost) {
  EXPECT_FALSE(Hold(0, 1000, false));
  EXPECT_FALSE(Hold(0, 50));
  EXPECT_TRUE(Hold(0, 1));
  EXPECT_FALSE(Hold(0, 1, false));
}

TEST_F(ContactLossTest, BeginsAnewWithAnotherPhase) {
  EXPECT_TRUE(Hold(0, 100));
  loss_.Reset();
  EXPECT_FALSE(loss_.lost());
  EXPECT_FALSE(Hold(0, 50));
  EXPECT_TRUE(Hold(0, 1));
}

}  // namespace
}  // namespace poise
