#include "tools/live/control_desk.h"

#include <algorithm>

namespace poise {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kShown = 24;  // acts that pages are told of

Json VectorJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

ControlDesk::Entry* ControlDesk::Find(int64_t client, int64_t id) {
  const auto found = std::find_if(acts_.rbegin(), acts_.rend(), [&](const Entry& entry) {
    return entry.act.client == client && entry.act.id == id;
  });
  return found == acts_.rend() ? nullptr : &*found;
}

bool ControlDesk::Receive(std::string_view text) {
  OperatorAct act;
  std::string problem;
  if (!ReadAct(text, &act, &problem)) {
    ++refused_;
    return false;
  }
  ++received_;
  // A hand on the robot sends thirty pushes a second: the last one stands for them.
  if (act.kind == OperatorAct::Kind::kPush && !acts_.empty()) {
    const Entry& last = acts_.back();
    if (last.act.kind == act.kind && last.act.client == act.client && last.act.name == act.name &&
        last.state == Entry::State::kAccepted) {
      acts_.pop_back();
    }
  }
  acts_.push_back({act, Entry::State::kSent, -1, {}});
  while (acts_.size() > kShown) acts_.pop_front();
  sink_->Do(act);
  return true;
}

Json ControlDesk::EntryJson(const Entry& entry) {
  constexpr const char* kStates[] = {"sent", "accepted", "refused"};
  const OperatorAct& act = entry.act;
  Json json = {{"client", act.client},
               {"id", act.id},
               {"do", ActName(act.kind)},
               {"state", kStates[static_cast<int>(entry.state)]}};
  if (entry.tick >= 0) json["tick"] = entry.tick;
  if (!entry.reason.empty()) json["reason"] = entry.reason;
  if (!act.name.empty()) json["name"] = act.name;
  switch (act.kind) {
    case OperatorAct::Kind::kPush:
      json["force"] = VectorJson(act.force);
      json["point"] = VectorJson(act.point);
      json["duration"] = act.duration;
      break;
    case OperatorAct::Kind::kWalk:
      json["velocity"] = VectorJson(act.velocity);
      break;
    case OperatorAct::Kind::kSet:
    case OperatorAct::Kind::kSpeed:
      json["value"] = act.value;
      break;
    case OperatorAct::Kind::kTick:
    case OperatorAct::Kind::kBack:
      json["ticks"] = act.ticks;
      break;
    default:
      break;
  }
  return json;
}

std::optional<std::string> ControlDesk::Take(std::string_view run_id, const Json& run) {
  for (OperatorSink::Answer& answer : sink_->TakeAnswers()) {
    Entry* const entry = Find(answer.client, answer.id);
    if (entry == nullptr) continue;  // many have come since
    entry->state = answer.accepted ? Entry::State::kAccepted : Entry::State::kRefused;
    entry->tick = answer.tick;
    entry->reason = std::move(answer.reason);
  }
  Json control = sink_->Standing();
  if (!run.is_null()) control["run"] = run;
  Json acts = Json::array();
  for (const Entry& entry : acts_) acts.push_back(EntryJson(entry));
  control["acts"] = std::move(acts);
  std::string text = Json({{"run_id", run_id}, {"control", std::move(control)}})
                         .dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text == told_) return {};
  told_ = std::move(text);
  return told_;
}

}  // namespace poise
