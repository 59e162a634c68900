// Where a page's acts go: the bus of a run of processes, or a run in this process.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/live/operator_act.h"

namespace poise {

/// Carries acts to those who decide, and tells what these have answered. Used on one thread.
class OperatorSink {
 public:
  /// What the one who receives an act answers, or what becomes of it on the way there.
  struct Answer {
    int64_t client = 0, id = 0;  ///< of the act
    bool accepted = false;
    int64_t tick = -1;   ///< at which it takes effect, when it is accepted
    std::string reason;  ///< why not
  };
  virtual ~OperatorSink() = default;

  /// Passes it on. It is in force only when an Answer says so.
  virtual void Do(const OperatorAct& act) = 0;
  /// Those that have come since the last call.
  virtual std::vector<Answer> TakeAnswers() = 0;
  /// What can be done here and what is in force, as receivers have told: keys as in
  /// docs/reference/interactive.md#what-a-page-is-told.
  virtual nlohmann::ordered_json Standing() const = 0;
};

}  // namespace poise
