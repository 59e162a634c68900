#include "logging/events/operator_words.h"

#include "fmt/format.h"
#include "logging/events/code_names.h"
#include "operate/act_t.hpp"
#include "operate/answer_t.hpp"

namespace poise::logging {

using operate::act_t;
using operate::answer_t;

namespace {

constexpr CodeName kKinds[] = {
    {act_t::KIND_PUSH, "push"},
    {act_t::KIND_SETTING, "setting"},
    {act_t::KIND_ASK, "question for a setting"},
    {act_t::KIND_STEP, "step"},
    {act_t::KIND_WALK, "walk"},
    {act_t::KIND_STAND, "feet side by side"},
    {act_t::KIND_NEXT_PHASE, "next phase"},
    {act_t::KIND_JOINT, "move of a joint"},
};

}  // namespace

std::string ActKindName(int8_t kind) { return NameOf(kKinds, kind, "act of kind"); }

std::string RefusalReason(int8_t kind, int8_t verdict) {
  const bool stand = kind == act_t::KIND_STAND;
  switch (verdict) {
    case answer_t::VERDICT_LATE:
      return "its tick was over";
    case answer_t::VERDICT_FAR:
      return "its tick is too far ahead";
    case answer_t::VERDICT_FULL:
      return "too many acts wait already";
    case answer_t::VERDICT_UNKNOWN:
      return "the component does not know it";
    case answer_t::VERDICT_RANGE:
      return kind == act_t::KIND_JOINT ? "the angle is outside the joint's range"
                                       : "a number is out of range";
    case answer_t::VERDICT_NOT_ABLE:
      if (stand) {
        return "this run's step_planner does not step; its scenario needs "
               "base: \"base/walking\" or step_planner.recovery.enabled=true";
      }
      if (kind == act_t::KIND_WALK || kind == act_t::KIND_STEP) {
        return "this run's step_planner does not walk; its scenario needs "
               "base: \"base/walking\"";
      }
      if (kind == act_t::KIND_JOINT) {
        return "this joint is a leg's, which keep the balance; arms, hands, head and waist can be "
               "moved";
      }
      return "this run's configuration does not allow it";
    case answer_t::VERDICT_NOT_NOW:
      if (stand || kind == act_t::KIND_STEP) {
        return "not now: the robot does not stand still on both feet; try again when it does";
      }
      if (kind == act_t::KIND_NEXT_PHASE) {
        return "not now: nothing follows this phase, or its moves are not over; try again later";
      }
      if (kind == act_t::KIND_JOINT) {
        return "not now: no posture is held yet, or the phase compensates gravity alone";
      }
      return "not now; try again later";
    default:
      return fmt::format("refused ({})", verdict);
  }
}

}  // namespace poise::logging
