#include "deploy/poise/run_status.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include "deploy/poise/report.h"
#include "deploy/poise/scenario_run.h"
#include "logging/events.h"
#include "logging/run_record.h"

namespace poise {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kPause{1};
constexpr int kShare = 9;  // times what a reading took: the pause after it
constexpr uintmax_t kMostBytes = uintmax_t{256} << 20;  // of log; as much again in memory

bool OnlyAtTheEnd(const CheckResult& check) {
  return check.name.starts_with("duration_reached") || check.name == "log_defects";
}

}  // namespace

nlohmann::ordered_json StatusJson(const std::string& log, const Scenario& scenario) {
  logging::RunRecord record = logging::ReadRun(log);
  PrepareRecord(log, scenario, &record);
  std::vector<CheckResult> checks = EvaluateChecks(scenario, record);
  std::erase_if(checks, OnlyAtTheEnd);
  return {{"checks", ChecksJson(checks)},
          {"events", EventsJson(logging::Events(record))},
          {"components", ComponentsJson(record.health)},
          {"checked_ticks", record.num_ticks}};
}

RunStatus::RunStatus(std::string log, Scenario scenario)
    : log_(std::move(log)), scenario_(std::move(scenario)), thread_([this] { Run(); }) {}

RunStatus::~RunStatus() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  stop_.notify_one();
  thread_.join();
}

std::optional<nlohmann::ordered_json> RunStatus::Take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(newest_, std::nullopt);
}

void RunStatus::Run() {
  Clock::duration pause = kPause;
  while (true) {
    const auto start = Clock::now();
    std::error_code error;
    if (std::filesystem::file_size(log_, error) <= kMostBytes) {
      std::optional<nlohmann::ordered_json> status;
      try {
        status = StatusJson(log_, scenario_);
      } catch (const std::exception& problem) {
        status = {{"problem", problem.what()}};  // the page tells
      }
      const std::lock_guard lock(mutex_);
      newest_ = std::move(status);
    }
    pause = std::max<Clock::duration>(kPause, kShare * (Clock::now() - start));
    std::unique_lock lock(mutex_);
    if (stop_.wait_for(lock, pause, [this] { return stopped_; })) return;
  }
}

}  // namespace poise
