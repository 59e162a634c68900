// Stands between the pages that may act and the one who carries their acts.
#pragma once

#include <cstdint>
#include <deque>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "tools/operator/act_port.h"

namespace poise {

/// Reads what pages send, passes acts on, and says what became of each. Any bytes are allowed.
/// Memory is bounded: the last acts alone are kept.
class ControlDesk {
 public:
  /// `port` must outlive it. Throws ConfigError, where the run takes no acts too, or RobotError.
  explicit ControlDesk(ActPort* port);

  /// A text of a page. False when it is no act: then its sender is none of our pages.
  bool Receive(std::string_view text);
  /// What all pages are to be told, when it has changed since the last call.
  /// `run`: of an interactive run, its pace; null: of another.
  std::optional<std::string> Take(std::string_view run_id,
                                  const nlohmann::ordered_json& run = nullptr);

  int64_t received() const { return received_; }  ///< acts
  int64_t refused() const { return refused_; }    ///< texts that are none

 private:
  /// Why an act is beyond what a page may ask for; empty: it is not.
  std::string BeyondPage(const OperatorAct& act) const;
  /// What can be done and what is in force, as receivers have told: keys as in
  /// docs/reference/interactive.md#what-a-page-is-told.
  nlohmann::ordered_json Standing() const;

  ActPort* port_;
  double push_limit_;  // N
  std::deque<OperatorAct> acts_;
  std::string told_;
  int64_t received_ = 0;
  int64_t refused_ = 0;
};

}  // namespace poise
