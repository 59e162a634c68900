#include "tools/report/machine_load.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

namespace poise {
namespace {

constexpr int64_t kInterval = 100'000'000;  // ns

/// us in which some process waited for a CPU, since the machine's start.
std::optional<int64_t> ReadStalled() {
  std::ifstream file("/proc/pressure/cpu");
  std::string word;
  while (file >> word) {
    if (!word.starts_with("total=")) continue;
    int64_t total = 0;
    for (const char c : word.substr(6)) total = 10 * total + (c - '0');
    return total;  // of the first line, "some"
  }
  return {};
}

}  // namespace

void MachineLoadSampler::Sample(int64_t now) {
  if (now < next_) return;
  next_ = now + kInterval;
  std::ifstream file("/proc/loadavg");
  double five = 0, fifteen = 0;
  int runnable = 0;
  if (file >> load_ >> five >> fifteen >> runnable) {
    ++samples_;
    const int others = std::max(0, runnable - 1);  // who reads runs as well
    sum_ += others;
    most_ = std::max(most_, others);
  }
  const std::optional<int64_t> stalled = ReadStalled();
  if (!stalled_first_) {
    stalled_first_ = stalled;
    start_ = now;
  }
  stalled_last_ = stalled;
  last_ = now;
}

MachineLoad MachineLoadSampler::Load() const {
  MachineLoad load;
  load.cpus = static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN));
  load.load = load_;
  if (samples_ > 0) load.runnable = static_cast<double>(sum_) / static_cast<double>(samples_);
  load.runnable_max = most_;
  if (stalled_first_ && stalled_last_ && last_ > start_) {
    load.pressure = std::clamp(static_cast<double>(*stalled_last_ - *stalled_first_) * 1e3 /
                                   static_cast<double>(last_ - start_),
                               0.0, 1.0);
  }
  return load;
}

}  // namespace poise
