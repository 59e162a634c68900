#include "components/framework/operator_acts.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "components/framework/configuration/configuration.h"

namespace poise {
namespace {

using operate::act_t;
using operate::answer_t;
using ActTraits = MessageTraits<act_t>;

// Acts that wait for their tick at most: a drag sends 30 a second, each some 50 ms ahead.
constexpr size_t kMostWaiting = 64;
constexpr size_t kAnswersKept = 64;
// Ticks that an act may lie ahead: half a minute at 500 Hz. Farther is a wrong tick, not a plan.
constexpr int64_t kMostAhead = 16384;

std::string_view FieldOf(const act_t& act) {
  const auto* const text = reinterpret_cast<const char*>(act.field);
  return {text, strnlen(text, sizeof act.field)};
}

}  // namespace

void LiveSettings::Add(std::string field, double* value, double least, double most, double ramp) {
  if (field.size() >= sizeof(act_t::field)) {
    throw ConfigError(field, "is too long for a live setting");
  }
  settings_.push_back({std::move(field), value, least, most, ramp});
}

const LiveSetting* LiveSettings::Find(const act_t& act) const {
  const std::string_view field = FieldOf(act);
  const auto found = std::ranges::find(settings_, field, &LiveSetting::field);
  return found == settings_.end() ? nullptr : &*found;
}

int8_t LiveSettings::Set(const act_t& act, int64_t tick) {
  const auto found = std::ranges::find(settings_, FieldOf(act), &LiveSetting::field);
  if (found == settings_.end()) return answer_t::VERDICT_UNKNOWN;
  if (!(act.value >= found->least && act.value <= found->most)) return answer_t::VERDICT_RANGE;
  found->from = *found->value;
  found->to = act.value;
  found->begin = tick;
  found->ticks = std::max<int64_t>(1, std::llround(found->ramp / period_));
  return answer_t::VERDICT_DONE;
}

bool LiveSettings::Advance(int64_t tick) {
  bool changed = false;
  for (LiveSetting& setting : settings_) {
    if (setting.ticks == 0) continue;
    changed = true;
    const int64_t gone = tick - setting.begin + 1;
    if (gone >= setting.ticks) {
      *setting.value = setting.to;
      setting.ticks = 0;
    } else {
      const double share = static_cast<double>(gone) / static_cast<double>(setting.ticks);
      *setting.value = setting.from + share * (setting.to - setting.from);
    }
  }
  return changed;
}

void LiveSettings::Archive(StateArchive* archive) {
  for (LiveSetting& s : settings_) archive->Show(*s.value, s.from, s.to, s.begin, s.ticks);
}

ActInput::ActInput() {
  waiting_.reserve(kMostWaiting);
  said_.resize(kAnswersKept);
}

const act_t* ActInput::Next(const Tick& tick) {
  if (open_) {
    open_ = false;
    Say(current_, verdict_);
  }
  now_ = tick;
  while (!waiting_.empty() && waiting_.front().tick <= tick.index) {
    current_ = waiting_.front().act;
    waiting_.erase(waiting_.begin());
    if (current_.kind != act_t::KIND_SETTING) {
      open_ = true;
      verdict_ = answer_t::VERDICT_DONE;
      return &current_;
    }
    Say(current_, settings_.Set(current_, tick.index), current_.value);
  }
  done_ = tick.index;
  return nullptr;
}

void ActInput::TakeSettings(const Tick& tick) {
  while (Next(tick) != nullptr) Answer(answer_t::VERDICT_UNKNOWN);
  settings_.Advance(tick.index);
}

void ActInput::Offer(const act_t& act) {
  if (act.component != component_) return;
  if (act.kind == act_t::KIND_ASK) {
    const LiveSetting* const setting = settings_.Find(act);
    Say(act, setting == nullptr ? answer_t::VERDICT_UNKNOWN : answer_t::VERDICT_DONE,
        setting == nullptr ? 0 : *setting->value);
    return;
  }
  for (Said& said : said_) {
    if (said.answer.id != act.id || said.answer.kind == 0) continue;
    said.untaken = true;  // its sender has not heard it
    return;
  }
  const auto same = [&](const Waiting& waiting) { return waiting.act.id == act.id; };
  if (std::ranges::any_of(waiting_, same) || (open_ && current_.id == act.id)) return;
  if (act.tick <= done_) return Say(act, answer_t::VERDICT_LATE);
  if (act.tick - done_ > kMostAhead) return Say(act, answer_t::VERDICT_FAR);
  if (waiting_.size() == kMostWaiting) return Say(act, answer_t::VERDICT_FULL);
  Place(act, act.tick);
}

void ActInput::Place(const act_t& act, int64_t tick) {
  const auto before = [](const Waiting& a, const Waiting& b) {
    return std::pair(a.tick, a.act.id) < std::pair(b.tick, b.act.id);
  };
  const Waiting waiting{act, tick};
  waiting_.insert(std::ranges::upper_bound(waiting_, waiting, before), waiting);
}

bool ActInput::TakeAnswer(answer_t* answer) {
  for (Said& said : said_) {
    if (!said.untaken) continue;
    said.untaken = false;
    *answer = said.answer;
    return true;
  }
  return false;
}

void ActInput::Say(const act_t& act, int8_t verdict, double value) {
  Said& said = said_[next_said_];
  next_said_ = (next_said_ + 1) % said_.size();
  said.untaken = true;
  said.answer = {};
  said.answer.run_id = act.run_id;
  said.answer.tick = now_.index;
  said.answer.utime = now_.utime;
  said.answer.id = act.id;
  said.answer.component = component_;
  said.answer.kind = act.kind;
  said.answer.verdict = verdict;
  said.answer.value = value;
}

const char* ActInput::type_name() const { return ActTraits::kName; }
int64_t ActInput::fingerprint() const { return act_t::getHash(); }
int ActInput::encoded_size() const { return act_t{}.getEncodedSize(); }

bool ActInput::Decode(const uint8_t* data, int size, void* message) const {
  auto& act = *static_cast<act_t*>(message);
  return act.decode(data, 0, size) == size && ActTraits::AllFinite(act);
}

std::span<const LiveSetting> LiveSettingsOf(const Wiring& wiring) {
  for (const InputPort* const port : wiring.inputs()) {
    if (const auto* acts = dynamic_cast<const ActInput*>(port)) return acts->settings().all();
  }
  return {};
}

}  // namespace poise
