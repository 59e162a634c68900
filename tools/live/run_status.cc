#include "tools/live/run_status.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "fmt/format.h"
#include "logging/events/events.h"
#include "logging/run_record.h"
#include "tools/report/html_report.h"
#include "tools/report/report.h"
#include "tools/report/run_story.h"
#include "tools/run/scenario_run.h"

namespace poise {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kPause{1};
constexpr int kShare = 9;  // times what a reading took: the pause after it
constexpr uintmax_t kMostBytes = uintmax_t{256} << 20;  // of a log that is read again and again
constexpr uintmax_t kMostAtTheEnd = uintmax_t{1} << 30;  // of one that is read once, for some 15 s

bool OnlyAtTheEnd(const CheckResult& check) {
  return check.name.starts_with("duration_reached") || check.name == "log_defects";
}

}  // namespace

nlohmann::ordered_json StatusJson(const std::string& log, const Scenario& scenario, bool ended) {
  logging::RunRecord record = logging::ReadRun(log);
  PrepareRecord(log, scenario, &record);
  std::vector<CheckResult> checks = EvaluateChecks(scenario, record);
  if (!ended) std::erase_if(checks, OnlyAtTheEnd);
  const std::vector<logging::Event> events = logging::Events(record, ended);
  nlohmann::ordered_json json = {{"ended", ended},
                                 {"checks", ChecksJson(checks)},
                                 {"events", EventsJson(events)},
                                 {"components", ComponentsJson(record.health)},
                                 {"checked_ticks", record.num_ticks}};
  if (ended) {
    json["run"] = PageRunJson(record, scenario, checks);
    json["story"] = TellRun(record, checks, events, "");
  } else {
    for (nlohmann::ordered_json& check : json["checks"]) check["passed"] = nullptr;
  }
  return json;
}

std::string StatusText(const std::string& run_id, nlohmann::ordered_json status) {
  using Json = nlohmann::ordered_json;
  return Json({{"run_id", run_id}, {"status", std::move(status)}})
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

RunStatus::RunStatus(std::string log, Scenario scenario)
    : log_(std::move(log)),
      scenario_(std::move(scenario)),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

void RunStatus::Finish() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  finished_.notify_one();
}

std::optional<nlohmann::ordered_json> RunStatus::Take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(newest_, std::nullopt);
}

void RunStatus::Run(const std::stop_token& stop) {
  bool ended = false;
  while (true) {
    const auto start = Clock::now();
    std::error_code error;
    const uintmax_t most = ended ? kMostAtTheEnd : kMostBytes;
    const bool readable = std::filesystem::file_size(log_, error) <= most;
    if (readable || ended) {
      nlohmann::ordered_json status;
      try {
        if (!readable) {
          throw std::runtime_error(
              fmt::format("{}: has more than {} MB, or cannot be read", log_, most >> 20));
        }
        status = StatusJson(log_, scenario_, ended);
      } catch (const std::exception& problem) {
        status = {{"ended", ended}, {"problem", problem.what()}};  // the page tells
      }
      const std::lock_guard lock(mutex_);
      newest_ = std::move(status);
    }
    if (ended) return;
    const auto pause = std::max<Clock::duration>(kPause, kShare * (Clock::now() - start));
    std::unique_lock lock(mutex_);
    finished_.wait_for(lock, stop, pause, [this] { return ended_; });
    if (stop.stop_requested()) return;
    ended = ended_;
  }
}

}  // namespace poise
