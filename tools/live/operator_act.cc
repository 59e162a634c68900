#include "tools/live/operator_act.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "fmt/format.h"

namespace poise {
namespace {

using Json = nlohmann::ordered_json;
using ActKind = OperatorAct::Kind;

constexpr size_t kMaxName = 128;          // characters; fields' paths have up to 60
constexpr size_t kMaxDepth = 3;           // of brackets; an act has an object and a list
constexpr double kMaxNumber = 1e9;        // beyond any force, time, gain or velocity
constexpr int64_t kMaxWhole = 1LL << 53;  // whole numbers of a page

struct Form {
  ActKind kind;
  std::string_view name;
  std::vector<std::string_view> keys;
};

const std::array<Form, 13>& Forms() {
  static const std::array<Form, 13> kForms{{
      {ActKind::kPush, "push", {"body", "force", "point", "duration"}},
      {ActKind::kSet, "set", {"field", "value"}},
      {ActKind::kStep, "step", {"foot"}},
      {ActKind::kWalk, "walk", {"velocity"}},
      {ActKind::kStopWalking, "stop_walking", {}},
      {ActKind::kStop, "stop", {}},
      {ActKind::kReset, "reset", {}},
      {ActKind::kPause, "pause", {}},
      {ActKind::kGo, "go", {}},
      {ActKind::kTick, "tick", {"ticks"}},
      {ActKind::kSpeed, "speed", {"value"}},
      {ActKind::kBack, "back", {"ticks"}},
      {ActKind::kRestart, "restart", {}},
  }};
  return kForms;
}

/// Brackets that are open at once: bounded before anything is read.
size_t Depth(std::string_view text) {
  size_t depth = 0, most = 0;
  for (const char c : text) {
    if (c == '{' || c == '[') most = std::max(most, ++depth);
    if ((c == '}' || c == ']') && depth > 0) --depth;
  }
  return most;
}

bool ReadWhole(const Json& json, int64_t* value) {
  if (!json.is_number_integer()) return false;
  if (json.is_number_unsigned() && json.get<uint64_t>() > static_cast<uint64_t>(kMaxWhole)) {
    return false;
  }
  *value = json.get<int64_t>();
  return *value >= 0 && *value <= kMaxWhole;
}

bool ReadNumber(const Json& json, double* value) {
  if (!json.is_number()) return false;
  *value = json.get<double>();
  return std::isfinite(*value) && std::abs(*value) <= kMaxNumber;
}

bool ReadVector(const Json& json, Eigen::Vector3d* value) {
  if (!json.is_array() || json.size() != 3) return false;
  for (size_t i = 0; i < 3; ++i) {
    if (!ReadNumber(json[i], &(*value)[static_cast<Eigen::Index>(i)])) return false;
  }
  return true;
}

bool ReadName(const Json& json, std::string* value) {
  if (!json.is_string()) return false;
  *value = json.get<std::string>();
  return value->size() <= kMaxName &&
         std::all_of(value->begin(), value->end(), [](char c) { return c >= ' ' && c <= '~'; });
}

bool ReadKey(std::string_view key, const Json& json, OperatorAct* act) {
  if (key == "body" || key == "field" || key == "foot") return ReadName(json, &act->name);
  if (key == "force") return ReadVector(json, &act->force);
  if (key == "point") return ReadVector(json, &act->point);
  if (key == "velocity") return ReadVector(json, &act->velocity);
  if (key == "duration") return ReadNumber(json, &act->duration) && act->duration >= 0;
  if (key == "value") return ReadNumber(json, &act->value);
  return ReadWhole(json, &act->ticks);
}

}  // namespace

std::string_view ActName(OperatorAct::Kind kind) {
  return std::find_if(Forms().begin(), Forms().end(), [&](const Form& f) { return f.kind == kind; })
      ->name;
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
      std::find_if(Forms().begin(), Forms().end(), [&](const Form& f) { return f.name == name; });
  if (form == Forms().end()) return fail("do: no such act");
  OperatorAct read;
  read.kind = form->kind;
  for (const auto& [key, to] : {std::pair{"client", &read.client}, std::pair{"id", &read.id}}) {
    const auto found = json.find(key);
    if (found == json.end() || !ReadWhole(*found, to)) {
      return fail(fmt::format("{}: must be a whole number", key));
    }
  }
  for (const std::string_view key : form->keys) {
    const auto found = json.find(std::string(key));
    if (found == json.end()) return fail(fmt::format("{}: missing", key));
    if (!ReadKey(key, *found, &read)) return fail(fmt::format("{}: not what it must be", key));
  }
  if (json.size() != 3 + form->keys.size()) return fail(fmt::format("{}: has other keys", name));
  *act = std::move(read);
  return true;
}

}  // namespace poise
