#include "tests/logging/damage_trial.h"

#include <lcm/eventlog.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "components/framework/bus/packet_filter.h"
#include "logging/log_reader.h"

namespace poise::logging {
namespace {

constexpr size_t kRecordHeader = 28;  // bytes of a record before its channel

const uint8_t* Data(const std::string& bytes) {
  return reinterpret_cast<const uint8_t*>(bytes.data());
}

/// The whole log's records, by number, that are still whole in the damaged one; else empty.
std::vector<std::string_view> UndamagedRecords(const std::string& whole,
                                               const std::string& damaged) {
  std::vector<std::string_view> records;
  for (size_t at = 0; at < whole.size();) {
    const size_t size = kRecordHeader + static_cast<size_t>(ReadInt32(Data(whole) + at + 20)) +
                        static_cast<size_t>(ReadInt32(Data(whole) + at + 24));
    const std::string_view record = std::string_view(whole).substr(at, size);
    const bool same = at + size <= damaged.size() && damaged.compare(at, size, record) == 0;
    records.push_back(same ? record : std::string_view());
    at += size;
  }
  return records;
}

/// True when the event is the undamaged record of its number.
bool IsUndamaged(const std::vector<std::string_view>& records, int64_t number, int64_t utime,
                 std::string_view channel, std::string_view data) {
  if (number < 0 || static_cast<size_t>(number) >= records.size()) return false;
  const std::string_view record = records[static_cast<size_t>(number)];
  return record.size() == kRecordHeader + channel.size() + data.size() &&
         ReadInt64(reinterpret_cast<const uint8_t*>(record.data()) + 12) == utime &&
         record.substr(kRecordHeader, channel.size()) == channel &&
         record.substr(kRecordHeader + channel.size()) == data;
}

int64_t CountWithPoise(const std::vector<std::string_view>& records, const std::string& path) {
  LogReader reader(path);
  LogEvent event;
  int64_t count = 0;
  while (reader.Next(&event)) {
    const std::string_view data(reinterpret_cast<const char*>(event.data.data()),
                                event.data.size());
    count += IsUndamaged(records, event.number, event.utime, event.channel, data) ? 1 : 0;
  }
  return count;
}

/// In a child with little memory and time; `count` is shared with it.
void CountWithLiblcm(const std::vector<std::string_view>& records, const std::string& path,
                     volatile int64_t* count) {
  const rlimit seconds{10, 10};
  setrlimit(RLIMIT_CPU, &seconds);
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  lcm_eventlog_t* const log = lcm_eventlog_create(path.c_str(), "r");
  if (log == nullptr) return;
  while (lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log)) {
    const bool whole =
        IsUndamaged(records, event->eventnum, event->timestamp,
                    {event->channel, static_cast<size_t>(event->channellen)},
                    {static_cast<const char*>(event->data), static_cast<size_t>(event->datalen)});
    *count = *count + (whole ? 1 : 0);
    lcm_eventlog_free_event(event);
  }
}

}  // namespace

std::string CutAnywhere(const std::string& bytes, std::mt19937* random) {
  return bytes.substr(0, std::uniform_int_distribution<size_t>(0, bytes.size() - 1)(*random));
}

std::string Overwrite(std::string bytes, size_t count, std::mt19937* random) {
  std::uniform_int_distribution<size_t> place(0, bytes.size() - 1);
  std::uniform_int_distribution<int> value(0, 255);
  for (size_t i = 0; i < count; ++i) bytes[place(*random)] = static_cast<char>(value(*random));
  return bytes;
}

DamageTrial TryDamage(const std::string& whole, const std::string& damaged,
                      const std::string& path) {
  std::ofstream(path, std::ios::binary) << damaged;
  const std::vector<std::string_view> records = UndamagedRecords(whole, damaged);
  DamageTrial trial;
  trial.records = static_cast<int64_t>(records.size());
  trial.undamaged = std::count_if(records.begin(), records.end(),
                                  [](std::string_view record) { return !record.empty(); });
  trial.by_poise = CountWithPoise(records, path);

  void* const shared =
      mmap(nullptr, sizeof(int64_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) throw std::runtime_error("mmap failed");
  auto* const count = static_cast<volatile int64_t*>(shared);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child == 0) {
    if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(0);
    CountWithLiblcm(records, path, count);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  trial.by_liblcm = *count;
  trial.liblcm_crashed = !WIFEXITED(status) || WEXITSTATUS(status) != 0;
  munmap(shared, sizeof(int64_t));
  return trial;
}

}  // namespace poise::logging
