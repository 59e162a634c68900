// A call for each type of message, of all packages.
#pragma once

#include "derived/message_traits.hpp"
#include "operate/message_traits.hpp"
#include "poise/message_traits.hpp"
#include "steps/message_traits.hpp"

namespace poise {

/// f.operator()<T>() for each.
template <class F>
void ForEveryType(F&& f) {
  ForEachMessageType(f);
  f.template operator()<operate::act_t>();
  f.template operator()<operate::answer_t>();
  f.template operator()<steps::footsteps_t>();
  f.template operator()<steps::stride_t>();
  f.template operator()<derived::signals_t>();
}

}  // namespace poise
