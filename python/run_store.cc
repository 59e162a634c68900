#include "python/run_store.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/run.h"
#include "components/robot_files/robot_files.h"
#include "derived/message_traits.hpp"
#include "fmt/format.h"
#include "logging/derived/derived_signals.h"

namespace poise::python {

using logging::LogError;

namespace {

/// By ascending tick, the first of each.
void SortByTick(StoredChannel* channel) {
  if (std::ranges::adjacent_find(channel->ticks, std::greater_equal<>()) == channel->ticks.end()) {
    return;
  }
  std::vector<size_t> order(channel->ticks.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, {}, [&](size_t i) { return channel->ticks[i]; });
  std::vector<int64_t> ticks;
  std::vector<uint64_t> offsets;
  for (const size_t i : order) {
    if (!ticks.empty() && ticks.back() == channel->ticks[i]) continue;
    ticks.push_back(channel->ticks[i]);
    offsets.push_back(channel->offsets[i]);
  }
  channel->ticks = std::move(ticks);
  channel->offsets = std::move(offsets);
}

}  // namespace

RunStore::RunStore(const std::string& log) : log_(log), messages_(std::in_place, log) {
  spec_ = messages_->spec();
  scenario_ = messages_->info().scenario;
  robot_ = messages_->info().robot;
  urdf_ = messages_->info().urdf;
  names_ = messages_->names();
  struct Lane {
    StoredChannel* channel = nullptr;
    std::optional<PacketFilter> filter;
    bool external = false;
  };
  std::map<std::string, Lane, std::less<>> lanes;
  for (const Channel& channel : spec_.graph().channel()) {
    const MessageType* const type = FindMessageType(channel.type());
    if (type == nullptr || type->has_strings) continue;
    const std::vector<int32_t> counts(channel.count().begin(), channel.count().end());
    constexpr int64_t kMost = 1 << 20;  // bytes of a message: no robot needs more
    if (type->encoded_size(counts) > kMost) {
      throw LogError(fmt::format("{}: channel {}: its messages are said to have {} bytes", log_,
                                 channel.name(), type->encoded_size(counts)));
    }
    channels_.push_back(std::make_unique<StoredChannel>(channel.name(), *type, counts));
    lanes.emplace(channel.name(),
                  Lane{channels_.back().get(),
                       PacketFilter(type->fingerprint, static_cast<int>(type->encoded_size(counts)),
                                    counts, spec_.run_id()),
                       channel.external()});
  }
  logging::LogReader& reader = messages_->reader();
  bytes_ = reader.bytes();
  logging::LogEvent event;
  while (reader.Next(&event)) {
    const auto found = lanes.find(event.channel);
    if (found == lanes.end()) continue;
    const Lane& lane = found->second;
    if (lane.filter->Check(event.data.data(), event.data.size(), 0, INT64_MAX) !=
        PacketVerdict::kAccepted) {
      continue;
    }
    const auto offset = static_cast<uint64_t>(event.data.data() - bytes_);
    lane.channel->ticks.push_back(
        lane.external ? static_cast<int64_t>(std::llround(static_cast<double>(event.utime) * 1e-6 /
                                                          spec_.tick_period()))
                      : lane.filter->tick(event.data.data()));
    lane.channel->offsets.push_back(offset);
  }
  damages_ = reader.damages();
  for (const auto& [name, lane] : lanes) {
    if (!lane.external) SortByTick(lane.channel);
  }
  std::erase_if(channels_, [](const auto& channel) { return channel->ticks.empty(); });
  AddDerived();
}

void RunStore::AddDerived() {
  if (channels_.empty()) return;
  try {
    model_ = record_ ? record_->robot : robot::LoadRobotTexts(robot_, urdf_);
  } catch (const robot::RobotError&) {
    return;
  }
  const logging::DerivedSignals signals(spec_, *model_);
  if (!signals.any()) return;
  const MessageType* const type = FindMessageType(MessageTraits<derived::signals_t>::kName);
  channels_.push_back(
      std::make_unique<StoredChannel>(logging::kDerivedChannel, *type, signals.counts()));
  derived_ = channels_.back().get();
}

void RunStore::ComputeDerived() const {
  struct Source {
    const StoredChannel* channel;
    size_t row = 0;
    int64_t tick() const { return row < channel->ticks.size() ? channel->ticks[row] : INT64_MAX; }
  };
  std::vector<Source> sources;
  std::set<std::string_view> types;  // of several channels with one type the first is taken
  for (const auto& channel : channels_) {
    if (channel.get() != derived_ && types.insert(channel->type->name).second) {
      sources.push_back({channel.get()});
    }
  }
  logging::DerivedSignals signals(spec_, *model_);
  // What an attempt before left, which threw.
  derived_->ticks.clear();
  derived_->offsets.clear();
  derived_bytes_ = logging::PagedFile::Scratch();
  std::vector<uint8_t> bytes(derived_->layout.size());
  while (true) {
    logging::TickMessages messages;
    messages.tick = std::ranges::min(sources, {}, &Source::tick).tick();
    if (messages.tick == INT64_MAX) return;
    bool any = false;
    for (Source& source : sources) {
      for (; source.tick() == messages.tick; ++source.row) {
        const uint8_t* const data = Message(*source.channel, source.row);
        if (!messages.Take(source.channel->type->name, {data, source.channel->layout.size()})) {
          continue;
        }
        any = true;
        messages.utime = ReadInt64(data + source.channel->type->run_id_offset + 16);
      }
    }
    if (!any) continue;
    const int64_t tick = messages.tick;
    const derived::signals_t& derived = signals.Next(std::move(messages));
    derived.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    derived_->offsets.push_back(derived_bytes_->Append(bytes));
    derived_->ticks.push_back(tick);
  }
}

RunStore::RunStore(const RunSpec& spec, std::string scenario)
    : spec_(spec), scenario_(std::move(scenario)) {
  robot_ = ResourceOf(spec, "robot").text();
  urdf_ = ResourceOf(spec, "urdf").text();
  names_ = logging::ElementNames::OfSpec(spec);
  for (const Channel& channel : spec.graph().channel()) {
    const MessageType* const type = FindMessageType(channel.type());
    of_graph_.push_back(nullptr);
    if (type == nullptr || type->has_strings || channel.external()) continue;
    const std::vector<int32_t> counts(channel.count().begin(), channel.count().end());
    channels_.push_back(std::make_unique<StoredChannel>(channel.name(), *type, counts));
    of_graph_.back() = channels_.back().get();
  }
}

void RunStore::Add(int channel, int64_t tick, const OutputPort& output) {
  StoredChannel* const to = of_graph_[static_cast<size_t>(channel)];
  if (to == nullptr) return;
  const size_t at = memory_.size();
  memory_.resize(at + to->layout.size());
  output.Encode(memory_.data() + at, static_cast<int>(to->layout.size()));
  to->ticks.push_back(tick);
  to->offsets.push_back(at);
}

void RunStore::Finish(std::optional<logging::RunRecord> record) {
  bytes_ = memory_.data();
  const std::lock_guard lock(record_mutex_);
  record_ = std::move(record);
  std::erase_if(channels_, [](const auto& channel) { return channel->ticks.empty(); });
  AddDerived();
}

const StoredChannel* RunStore::Find(std::string_view name) const {
  for (const auto& channel : channels_) {
    if (channel->name != name) continue;
    if (channel.get() == derived_) {
      CheckUnchanged();
      std::call_once(derived_once_, [this] { ComputeDerived(); });
    }
    return channel.get();
  }
  return nullptr;
}

void RunStore::CheckUnchanged() const {
  if (!messages_ || !messages_->reader().file_changed()) return;
  throw LogError(fmt::format("{}: has changed since it was opened; open the run again", log_));
}

logging::RunRecord& RunStore::record() const {
  if (!record_) {
    if (log_.empty()) throw LogError("the run keeps no record");
    record_.emplace(logging::ReadRun(log_));
  }
  return *record_;
}

}  // namespace poise::python
