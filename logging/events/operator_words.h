// An operator's acts and what becomes of them, for people.
#pragma once

#include <cstdint>
#include <string>

namespace poise::logging {

/// operate::act_t::KIND_* in a word: "push", "setting".
std::string ActKindName(int8_t kind);
/// operate::answer_t::VERDICT_* of a refused act of that kind as a reason: "a number is out of
/// range".
std::string RefusalReason(int8_t kind, int8_t verdict);

}  // namespace poise::logging
