#include "tools/live/tick_ring.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>

#include "components/framework/run.h"
#include "components/robot_files/robot_files.h"
#include "derived/message_traits.hpp"
#include "logging/derived/told.h"
#include "logging/export/signal_table.h"
#include "tools/live/field_selection.h"

namespace poise {
namespace {

static_assert(std::endian::native == std::endian::little, "a batch is little-endian");

constexpr uint32_t kBatchFormat = 2;
constexpr int64_t kMaxTick = int64_t{1} << 52;  // what a batch can tell

struct BatchHeader {
  uint32_t format = kBatchFormat;
  uint32_t count = 0;
  double first_tick = 0;
  double end_tick = 0;  // of the ring
  double time = 0;      // s, of the server's clock
};

/// NaN for what a page takes for no number.
float ToFloat(double value) {
  return std::abs(value) <= std::numeric_limits<float>::max()
             ? static_cast<float>(value)
             : std::numeric_limits<float>::quiet_NaN();
}

}  // namespace

int64_t TicksOf(double seconds, double period) {
  return std::max<int64_t>(1, std::llround(seconds / period));
}

/// Writes a message's scalars to their places in a tick.
class TickRing::Filler : public ScalarVisitor {
 public:
  Filler(const Place& place, double* integers, float* reals)
      : kinds_(place.kinds),
        integers_(integers + place.first_integer),
        reals_(reals + place.first_real) {}

  void Integer(std::string_view, int64_t value) override { Put(static_cast<double>(value)); }
  void Real(std::string_view, double value) override { Put(value); }
  void Text(std::string_view, std::string_view) override { ++next_; }

 private:
  void Put(double value) {
    if (next_ == kinds_.size()) return;
    const Kind kind = kinds_[next_++];
    if (kind == Kind::kInteger) *integers_++ = value;
    if (kind == Kind::kReal) *reals_++ = ToFloat(value);
  }

  const std::vector<Kind>& kinds_;
  size_t next_ = 0;
  double* integers_;
  float* reals_;
};

TickRing::TickRing(const RunSpec& spec, int64_t capacity)
    : capacity_(capacity), slots_(capacity + kReceiveWindow), planned_(spec.num_ticks()) {
  for (const Channel& channel : spec.graph().channel()) {
    const MessageType* type = FindMessageType(channel.type());
    dense_ += channel.external() ? 0 : 1;
    AddLane({channel.name(), type, channel.external(), {}},
            {channel.count().begin(), channel.count().end()});
  }
  AddDerivedLane(spec);
  const auto slots = static_cast<size_t>(slots_);
  integer_values_.resize(slots * integers_);
  real_values_.resize(slots * reals_);
  arrived_.resize(slots);
  last_tick_.assign(lanes_.size(), -1);
}

void TickRing::AddLane(Lane lane, const std::vector<int32_t>& counts) {
  Place place{{}, integers_, reals_};
  const auto scalars = ReadScalars(*lane.type, ZeroMessage(*lane.type, counts));
  for (const Scalar& scalar : scalars.value()) {
    const bool integer = std::holds_alternative<int64_t>(scalar.value);
    const bool told = lane.name != logging::kDerivedChannel || derived_ == nullptr ||
                      derived_->signals().Tells(scalar.path);
    if (!told || !logging::IsSignal(*lane.type, scalar.path)) {
      place.kinds.push_back(Kind::kNone);
      continue;
    }
    place.kinds.push_back(integer ? Kind::kInteger : Kind::kReal);
    ++(integer ? integers_ : reals_);
    lane.signals.push_back({scalar.path, integer});
  }
  lanes_.push_back(std::move(lane));
  places_.push_back(std::move(place));
}

void TickRing::AddDerivedLane(const RunSpec& spec) {
  try {
    robot_ = std::make_shared<const robot::RobotModel>(
        robot::LoadRobotTexts(ResourceOf(spec, "robot").text(), ResourceOf(spec, "urdf").text()));
  } catch (const robot::RobotError&) {
    return;
  }
  derived_ = std::make_unique<logging::DerivedMessages>(spec, *robot_);
  if (!derived_->signals().any()) {
    derived_.reset();
    return;
  }
  AddLane({logging::kDerivedChannel,
           FindMessageType(MessageTraits<derived::signals_t>::kName),
           false,
           {}},
          derived_->signals().counts());
}

nlohmann::ordered_json TickRing::ChannelsJson() const {
  using Json = nlohmann::ordered_json;
  Json json = Json::array();
  for (const Lane& lane : lanes_) {
    Json item = {{"name", lane.name}, {"type", lane.type->name}, {"count", 0}};
    if (lane.external) item["ticks"] = {{"value", nullptr}};
    item["signals"] = Json::array();
    for (const Signal& signal : lane.signals) {
      item["signals"].push_back({{"field", signal.field}, {"integer", signal.integer}});
    }
    json.push_back(std::move(item));
  }
  return json;
}

void TickRing::Clear(int64_t tick) {
  const size_t slot = Slot(tick);
  std::fill_n(integer_values_.begin() + static_cast<std::ptrdiff_t>(slot * integers_), integers_,
              std::numeric_limits<double>::quiet_NaN());
  std::fill_n(real_values_.begin() + static_cast<std::ptrdiff_t>(slot * reals_), reals_,
              std::numeric_limits<float>::quiet_NaN());
  arrived_[slot] = 0;
}

void TickRing::Start(int64_t tick) {
  start_ = first_ = end_ = tick;
  for (int64_t t = tick; t < tick + kReceiveWindow; ++t) Clear(t);
}

void TickRing::Take() {
  std::span<const uint8_t> derived;
  if (derived_ && derived_->TakeTick(end_, &derived)) Fill(lanes_.size() - 1, derived, end_);
  const int missing = dense_ - arrived_[Slot(end_)];
  // Who comes late has missed parts of the first ticks.
  const bool beginning = first_ == end_ && end_ < start_ + kMaxLead;
  ++end_;
  if (beginning && missing > 0) {
    first_ = end_;
  } else {
    lost_ += missing;
    first_ = std::max(first_, end_ - capacity_);
  }
  Clear(end_ + kReceiveWindow - 1);
}

void TickRing::TakeUntil(int64_t tick) {
  if (tick - end_ > capacity_) {
    lost_ += dense_ * (tick - end_);
    Start(tick);
  }
  while (end_ < tick) Take();
}

void TickRing::TakeComplete() {
  while (end_ <= newest_ && (arrived_[Slot(end_)] == dense_ || newest_ >= end_ + kMaxLead)) Take();
}

void TickRing::Fill(size_t lane, std::span<const uint8_t> data, int64_t tick) {
  data = logging::WithoutUntold(*lanes_[lane].type, data, &told_);
  const size_t slot = Slot(tick);
  Filler filler(places_[lane], integer_values_.data() + slot * integers_,
                real_values_.data() + slot * reals_);
  lanes_[lane].type->visit(data.data(), static_cast<int64_t>(data.size()), &filler);
}

void TickRing::Add(const LiveMessage& message) {
  if (message.index < 0) return;
  const auto channel = static_cast<size_t>(message.index);
  if (lanes_[channel].external) {
    if (newest_ >= 0) Fill(channel, message.data, std::max(newest_, end_));
    return;
  }
  const int64_t tick = message.tick;
  if (tick < 0 || tick > kMaxTick || (planned_ > 0 && tick >= planned_)) return;
  if (newest_ < 0) Start(tick);
  if (tick >= end_ + kReceiveWindow) {
    // A tick is so far ahead after a long pause of this process; one stray packet moves nothing.
    const bool confirmed = jump_ >= 0 && std::abs(tick - jump_) <= kMaxLead;
    jump_ = confirmed ? -1 : tick;
    if (!confirmed) return;
    TakeUntil(tick - kMaxLead);
  } else {
    jump_ = -1;
  }
  newest_ = std::max(newest_, tick);
  if (tick < end_ || tick <= last_tick_[channel]) return;
  last_tick_[channel] = tick;
  Fill(channel, message.data, tick);
  if (derived_) derived_->Add(message.channel, *message.type, message.data);
  ++arrived_[Slot(tick)];
  TakeComplete();
}

void TickRing::Finish() {
  if (newest_ >= 0) TakeUntil(newest_ + 1);
}

std::string TickRing::Encode(int64_t from, int64_t to, double time) const {
  const auto count = static_cast<size_t>(to - from);
  const BatchHeader header{kBatchFormat, static_cast<uint32_t>(count), static_cast<double>(from),
                           static_cast<double>(end_), time};
  std::string batch(sizeof(header) + count * tick_size(), '\0');
  std::memcpy(batch.data(), &header, sizeof(header));
  char* const integers = batch.data() + sizeof(header);
  char* const reals = integers + count * integers_ * sizeof(double);
  for (size_t row = 0; row < count; ++row) {
    const size_t slot = Slot(from + static_cast<int64_t>(row));
    for (size_t k = 0; k < integers_; ++k) {
      std::memcpy(integers + (k * count + row) * sizeof(double),
                  &integer_values_[slot * integers_ + k], sizeof(double));
    }
    for (size_t k = 0; k < reals_; ++k) {
      std::memcpy(reals + (k * count + row) * sizeof(float), &real_values_[slot * reals_ + k],
                  sizeof(float));
    }
  }
  return batch;
}

}  // namespace poise
