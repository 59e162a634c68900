#include "tools/operator/operator_act.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>

#include "fmt/format.h"
#include "operate/act_t.hpp"

namespace poise {
namespace {

using Json = nlohmann::ordered_json;
using ActKind = OperatorAct::Kind;
using operate::act_t;

constexpr size_t kMaxName = 128;          // characters; fields' paths have up to 60
constexpr size_t kMaxDepth = 3;           // of brackets; an act has an object and a list
constexpr double kMaxNumber = 1e9;        // beyond any force, time, gain or velocity
constexpr int64_t kMaxWhole = 1LL << 53;  // whole numbers of a page

/// A part of an act by its key in a page's text.
struct Part {
  std::string_view key;
  std::variant<std::string OperatorAct::*, Eigen::Vector3d OperatorAct::*, double OperatorAct::*,
               int64_t OperatorAct::*>
      part;
};
constexpr Part kBody{"body", &OperatorAct::name}, kField{"field", &OperatorAct::name},
    kFoot{"foot", &OperatorAct::name}, kJoint{"joint", &OperatorAct::name},
    kForce{"force", &OperatorAct::force}, kPoint{"point", &OperatorAct::point},
    kVelocity{"velocity", &OperatorAct::velocity}, kDuration{"duration", &OperatorAct::duration},
    kValue{"value", &OperatorAct::value}, kTicks{"ticks", &OperatorAct::ticks};

/// All that tells one act from another, but for how it fills its message (ActPort).
struct Form {
  ActKind kind;
  std::string_view name;
  int8_t message;  // KIND_*; 0: none
  bool page;       // a page may send it
  std::vector<Part> parts;
};

const std::vector<Form>& Forms() {
  static const std::vector<Form> kForms{
      {ActKind::kPush, "push", act_t::KIND_PUSH, true, {kBody, kForce, kPoint, kDuration}},
      {ActKind::kSet, "set", act_t::KIND_SETTING, true, {kField, kValue}},
      {ActKind::kAsk, "ask", act_t::KIND_ASK, false, {kField}},
      {ActKind::kStep, "step", act_t::KIND_STEP, true, {kFoot}},
      {ActKind::kWalk, "walk", act_t::KIND_WALK, true, {kVelocity}},
      {ActKind::kStopWalking, "stop_walking", act_t::KIND_STAND, true, {}},
      {ActKind::kNextPhase, "next_phase", act_t::KIND_NEXT_PHASE, false, {}},
      {ActKind::kMove, "move", act_t::KIND_JOINT, true, {kJoint, kValue, kDuration}},
      {ActKind::kStop, "stop", 0, true, {}},
      {ActKind::kReset, "reset", 0, true, {}},
      {ActKind::kPause, "pause", 0, true, {}},
      {ActKind::kGo, "go", 0, true, {}},
      {ActKind::kTick, "tick", 0, true, {kTicks}},
      {ActKind::kSpeed, "speed", 0, true, {kValue}},
      {ActKind::kBack, "back", 0, true, {kTicks}},
      {ActKind::kRestart, "restart", 0, true, {}},
  };
  return kForms;
}

const Form& FormOf(ActKind kind) { return *std::ranges::find(Forms(), kind, &Form::kind); }

/// Brackets that are open at once: bounded before anything is read.
size_t Depth(std::string_view text) {
  size_t depth = 0, most = 0;
  for (const char c : text) {
    if (c == '{' || c == '[') most = std::max(most, ++depth);
    if ((c == '}' || c == ']') && depth > 0) --depth;
  }
  return most;
}

bool Read(const Json& json, int64_t* value) {
  if (!json.is_number_integer()) return false;
  if (json.is_number_unsigned() && json.get<uint64_t>() > static_cast<uint64_t>(kMaxWhole)) {
    return false;
  }
  *value = json.get<int64_t>();
  return *value >= 0 && *value <= kMaxWhole;
}

bool Read(const Json& json, double* value) {
  if (!json.is_number()) return false;
  *value = json.get<double>();
  return std::isfinite(*value) && std::abs(*value) <= kMaxNumber;
}

bool Read(const Json& json, Eigen::Vector3d* value) {
  if (!json.is_array() || json.size() != 3) return false;
  for (size_t i = 0; i < 3; ++i) {
    if (!Read(json[i], &(*value)[static_cast<Eigen::Index>(i)])) return false;
  }
  return true;
}

bool Read(const Json& json, std::string* value) {
  if (!json.is_string()) return false;
  *value = json.get<std::string>();
  return value->size() <= kMaxName &&
         std::all_of(value->begin(), value->end(), [](char c) { return c >= ' ' && c <= '~'; });
}

Json Told(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
template <class Number>
Json Told(Number value) {
  return value;
}

}  // namespace

std::string_view ActName(ActKind kind) { return FormOf(kind).name; }
int8_t MessageKind(ActKind kind) { return FormOf(kind).message; }

const std::vector<ActKind>& PageActs() {
  static const std::vector<ActKind> kActs = [] {
    std::vector<ActKind> acts;
    for (const Form& form : Forms()) {
      if (form.page) acts.push_back(form.kind);
    }
    return acts;
  }();
  return kActs;
}

bool ReadAct(std::string_view text, OperatorAct* act, std::string* problem) {
  const auto fail = [&](std::string why) {
    *problem = std::move(why);
    return false;
  };
  if (Depth(text) > kMaxDepth) return fail("too many brackets");
  const Json json = Json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) return fail("no JSON object");
  const auto kind = json.find("do");
  if (kind == json.end() || !kind->is_string()) return fail("do: missing");
  const std::string name = kind->get<std::string>();
  const auto form =
      std::ranges::find_if(Forms(), [&](const Form& f) { return f.page && f.name == name; });
  if (form == Forms().end()) return fail("do: no such act");
  OperatorAct read;
  read.kind = form->kind;
  for (const auto& [key, to] : {std::pair{"client", &read.client}, std::pair{"id", &read.id}}) {
    const auto found = json.find(key);
    if (found == json.end() || !Read(*found, to)) {
      return fail(fmt::format("{}: must be a whole number", key));
    }
  }
  for (const Part& part : form->parts) {
    const auto found = json.find(std::string(part.key));
    if (found == json.end()) return fail(fmt::format("{}: missing", part.key));
    const bool good =
        std::visit([&](const auto member) { return Read(*found, &(read.*member)); }, part.part);
    // A page's push ends: who lets go, or dies, holds nobody.
    if (!good || read.duration < 0) return fail(fmt::format("{}: not what it must be", part.key));
  }
  if (json.size() != 3 + form->parts.size()) return fail(fmt::format("{}: has other keys", name));
  *act = std::move(read);
  return true;
}

Json ActJson(const OperatorAct& act) {
  constexpr const char* kStates[] = {"sent", "accepted", "refused"};
  Json json = {{"client", act.client},
               {"id", act.id},
               {"do", ActName(act.kind)},
               {"state", kStates[static_cast<int>(act.state)]}};
  if (act.tick >= 0) json["tick"] = act.tick;
  if (!act.reason.empty()) json["reason"] = act.reason;
  if (!act.name.empty()) json["name"] = act.name;
  for (const Part& part : FormOf(act.kind).parts) {
    if (std::holds_alternative<std::string OperatorAct::*>(part.part)) continue;  // told as name
    json[std::string(part.key)] =
        std::visit([&](const auto member) { return Told(act.*member); }, part.part);
  }
  return json;
}

}  // namespace poise
