// Between the pages that may act and the one who carries their acts.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

#include "tools/live/operator_sink.h"

namespace poise {

/// Reads what pages send, passes acts on, and says what became of each. Any bytes are allowed.
/// Memory is bounded: the last acts alone are kept.
class ControlDesk {
 public:
  /// `sink` must outlive it.
  explicit ControlDesk(OperatorSink* sink) : sink_(sink) {}

  /// A text of a page. False when it is no act: then its sender is none of our pages.
  bool Receive(std::string_view text);
  /// What all pages are to be told, when it has changed since the last call.
  /// `run`: of an interactive run, its pace; null: of another.
  std::optional<std::string> Take(std::string_view run_id,
                                  const nlohmann::ordered_json& run = nullptr);

  int64_t received() const { return received_; }  ///< acts
  int64_t refused() const { return refused_; }    ///< texts that are none

 private:
  struct Entry {
    OperatorAct act;
    enum class State : uint8_t { kSent, kAccepted, kRefused } state = State::kSent;
    int64_t tick = -1;
    std::string reason;
  };
  static nlohmann::ordered_json EntryJson(const Entry& entry);
  Entry* Find(int64_t client, int64_t id);

  OperatorSink* sink_;
  std::deque<Entry> acts_;
  std::string told_;
  int64_t received_ = 0;
  int64_t refused_ = 0;
};

}  // namespace poise
