#include "tools/live/control_desk.h"

#include <algorithm>
#include <cmath>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"

namespace poise {
namespace {

using Json = nlohmann::ordered_json;
using ActKind = OperatorAct::Kind;
using ActState = OperatorAct::State;

constexpr size_t kShown = 24;  // acts that pages are told of
// A page may push with this share of the robot's weight: no robot here stands more, and no slip of
// a hand tears one apart.
constexpr double kPushShare = 0.5;
constexpr double kLongestPush = 2;    // s: a page that wants more asks again
constexpr double kFastestWalk = 0.5;  // m/s and rad/s: what a page offers

}  // namespace

ControlDesk::ControlDesk(ActPort* port)
    : port_(port), push_limit_(std::round(kPushShare * port->weight())) {
  port_->fields();
}

std::string ControlDesk::BeyondPage(const OperatorAct& act) const {
  if (act.kind != ActKind::kPush) return {};
  // A rounding beyond the limit is no attack.
  if (act.force.norm() > push_limit_ * (1 + 1e-9)) {
    return fmt::format("{:.0f} N are more than a page may push with, {:.0f} N", act.force.norm(),
                       push_limit_);
  }
  if (act.duration > kLongestPush) {
    return fmt::format("{:.3g} s are longer than a page may push, {:.3g} s", act.duration,
                       kLongestPush);
  }
  return {};
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
  if (act.kind == ActKind::kPush && !acts_.empty()) {
    const OperatorAct& last = acts_.back();
    if (last.kind == act.kind && last.client == act.client && last.name == act.name &&
        last.state == ActState::kAccepted) {
      acts_.pop_back();
    }
  }
  acts_.push_back(act);
  while (acts_.size() > kShown) acts_.pop_front();
  act.reason = BeyondPage(act);
  try {
    if (act.reason.empty()) port_->Do(act);
  } catch (const ConfigError& error) {
    act.reason = error.what();
  }
  if (!act.reason.empty()) {
    act.state = ActState::kRefused;
    acts_.back() = std::move(act);
  }
  return true;
}

Json ControlDesk::Standing() const {
  const std::map<std::string, double> in_force = port_->InForce();
  Json settings = Json::array();
  for (const LiveField& field : port_->fields()) {
    const auto value = in_force.find(field.path);
    if (value == in_force.end()) continue;  // its component has told nothing yet
    settings.push_back({{"field", field.path},
                        {"unit", field.unit},
                        {"text", field.meaning},
                        {"low", field.least},
                        {"high", field.most},
                        {"ramp", field.ramp},
                        {"value", value->second}});
  }
  const Json fast = {kFastestWalk, kFastestWalk, kFastestWalk};
  const Json slow = {-kFastestWalk, -kFastestWalk, -kFastestWalk};
  Json can = Json::array();
  for (const ActKind kind : PageActs()) {
    if (port_->WhyNot(kind).empty()) can.push_back(ActName(kind));
  }
  Json json = {{"settings", std::move(settings)}, {"push_limit", push_limit_},
               {"push_longest", kLongestPush},    {"walk", {{"low", slow}, {"high", fast}}},
               {"can", std::move(can)},           {"stopped", port_->stopped()}};
  json["movable"] = Json::array();
  for (const MovableJoint& joint : port_->movable()) {
    json["movable"].push_back({{"joint", joint.name}, {"low", joint.lower}, {"high", joint.upper}});
  }
  if (const OperatorAct* const push = port_->push()) {
    json["push"] = {{"body", push->name},
                    {"force", {push->force.x(), push->force.y(), push->force.z()}}};
  }
  return json;
}

std::optional<std::string> ControlDesk::Take(std::string_view run_id, const Json& run) {
  for (OperatorAct& answer : port_->TakeAnswers()) {
    const auto act = std::find_if(acts_.rbegin(), acts_.rend(), [&](const OperatorAct& each) {
      return each.client == answer.client && each.id == answer.id;
    });
    if (act != acts_.rend()) *act = std::move(answer);  // else many have come since
  }
  Json control = Standing();
  if (!run.is_null()) control["run"] = run;
  Json acts = Json::array();
  for (const OperatorAct& act : acts_) acts.push_back(ActJson(act));
  control["acts"] = std::move(acts);
  std::string text = Json({{"run_id", run_id}, {"control", std::move(control)}})
                         .dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text == told_) return {};
  told_ = std::move(text);
  return told_;
}

}  // namespace poise
