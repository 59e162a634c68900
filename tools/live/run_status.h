// What the log of a run in progress says so far, for its page.
#pragma once

#include <condition_variable>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "tools/scenario/scenario.pb.h"

namespace poise {

/// {"ended", "checks", "events", "components", "checked_ticks"} of the log as it is, as in
/// summary.json. Before the run has ended no check has a verdict (passed: null), and what only its
/// end decides (its duration, its log being whole) is left out; after it "run" is what a page says
/// of the run itself, and "story" what happened. Throws LogError or RobotError.
nlohmann::ordered_json StatusJson(const std::string& log, const Scenario& scenario, bool ended);

/// The text that tells a page of it; what the log holds may be any bytes.
std::string StatusText(const std::string& run_id, nlohmann::ordered_json status);

/// Reads the log again and again on a thread of its own, which takes a tenth of one core at most; a
/// log that has become too large is left as it was read last.
class RunStatus {
 public:
  /// Its end waits for a reading under way.
  RunStatus(std::string log, Scenario scenario);

  /// The run has ended: the log is read once more, for its final status.
  void Finish();
  /// The newest that has not been taken.
  std::optional<nlohmann::ordered_json> Take();

 private:
  void Run(const std::stop_token& stop);

  const std::string log_;
  const Scenario scenario_;
  std::mutex mutex_;
  std::condition_variable_any finished_;
  bool ended_ = false;
  std::optional<nlohmann::ordered_json> newest_;
  std::jthread thread_;
};

}  // namespace poise
