#include <gtest/gtest.h>

#include <set>
#include <string>

#include "logging/events/bridge_words.h"
#include "logging/events/operator_words.h"
#include "operate/act_t.hpp"
#include "operate/answer_t.hpp"

namespace poise::logging {
namespace {

TEST(BridgeNames, EveryStateAndReasonHasItsOwn) {
  std::set<std::string> names;
  for (int8_t state = bridge_status_t::STATE_INIT; state <= bridge_status_t::STATE_ESTOP; ++state) {
    EXPECT_EQ(BridgeStateName(state).find("state "), std::string::npos) << int{state};
    EXPECT_TRUE(names.insert(BridgeStateName(state)).second) << int{state};
  }
  EXPECT_EQ(BridgeReasonName(bridge_status_t::REASON_NONE), "");
  for (int8_t reason = bridge_status_t::REASON_NO_COMMAND;
       reason <= bridge_status_t::REASON_SHUTDOWN; ++reason) {
    EXPECT_EQ(BridgeReasonName(reason).find("reason "), std::string::npos) << int{reason};
    EXPECT_TRUE(names.insert(BridgeReasonName(reason)).second) << int{reason};
  }
}

TEST(OperatorWords, EveryKindOfActAndRefusalHasItsOwn) {
  using operate::act_t;
  using operate::answer_t;
  std::set<std::string> words;
  for (int8_t kind = act_t::KIND_PUSH; kind <= act_t::KIND_NEXT_PHASE; ++kind) {
    EXPECT_EQ(ActKindName(kind).find("of kind"), std::string::npos) << int{kind};
    EXPECT_TRUE(words.insert(ActKindName(kind)).second) << int{kind};
  }
  for (int8_t verdict = answer_t::VERDICT_LATE; verdict <= answer_t::VERDICT_NOT_NOW; ++verdict) {
    const std::string reason = RefusalReason(act_t::KIND_PUSH, verdict);
    EXPECT_EQ(reason.find("refused ("), std::string::npos) << int{verdict};
    EXPECT_TRUE(words.insert(reason).second) << int{verdict};
  }
}

}  // namespace
}  // namespace poise::logging
