#include "logging/metrics/schedule_plan.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <memory>

#include "components/framework/configuration/configuration.h"

namespace poise::logging {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr const char* kSchema = "poise.StepPlannerConfig";
constexpr const char* kScenario = "poise.Scenario";

/// A field of a message by name; its schema is the only place that knows defaults.
class Reader {
 public:
  explicit Reader(const Message& message) : message_(message) {}

  bool Has(const char* name) const {
    return message_.GetReflection()->HasField(message_, &Field(name));
  }
  double Real(const char* name) const {
    return message_.GetReflection()->GetDouble(message_, &Field(name));
  }
  int Whole(const char* name) const {
    return message_.GetReflection()->GetInt32(message_, &Field(name));
  }
  bool Flag(const char* name) const {
    return message_.GetReflection()->GetBool(message_, &Field(name));
  }
  int Enum(const char* name) const {
    return message_.GetReflection()->GetEnumValue(message_, &Field(name));
  }
  std::string Text(const char* name) const {
    return message_.GetReflection()->GetString(message_, &Field(name));
  }
  Reader Part(const char* name) const {
    return Reader(message_.GetReflection()->GetMessage(message_, &Field(name)));
  }
  int Size(const char* name) const {
    return message_.GetReflection()->FieldSize(message_, &Field(name));
  }
  Reader Element(const char* name, int i) const {
    return Reader(message_.GetReflection()->GetRepeatedMessage(message_, &Field(name), i));
  }

 private:
  const FieldDescriptor& Field(const char* name) const {
    const FieldDescriptor* field = message_.GetDescriptor()->FindFieldByName(name);
    if (field == nullptr) {
      throw ConfigError(name, "is no field of " + message_.GetDescriptor()->full_name());
    }
    return *field;
  }

  const Message& message_;
};

/// Name of the component whose output is the channel of `type`; empty when there is none.
std::string WriterOf(const Graph& graph, const std::string& type) {
  for (const Channel& channel : graph.channel()) {
    if (channel.type() != type) continue;
    for (const ComponentInstance& component : graph.component()) {
      for (const Connection& output : component.output()) {
        if (output.channel() == channel.name()) return component.name();
      }
    }
  }
  return {};
}

PhasePlan ReadPhase(const Reader& phase) {
  PhasePlan plan;
  plan.name = phase.Text("name");
  plan.double_support = phase.Enum("support") == 0;  // the schema's first: DOUBLE
  if (!phase.Has("foot")) return plan;
  const Reader foot = phase.Part("foot");
  FootPlan& to = plan.foot.emplace();
  to.foot = foot.Enum("foot");
  to.above_support = foot.Has("height_above_support");
  to.z = foot.Real(to.above_support ? "height_above_support" : "z");
  to.at_once = foot.Real("delay") <= 0 && foot.Real("duration") <= 0;
  return plan;
}

/// Sets what follows each phase that is done: the one it names, else the one after it in the list.
void LinkPhases(const Reader& config, std::vector<PhasePlan>* phases) {
  constexpr int kDone = 1;  // the schema's first outcome
  const int count = config.Size("phase");
  for (int i = 0; i < count; ++i) {
    const Reader phase = config.Element("phase", i);
    int& next = (*phases)[static_cast<size_t>(i)].next;
    if (!phase.Has("duration")) continue;
    if (i + 1 < count) next = i + 1;
    for (int k = 0; k < phase.Size("next"); ++k) {
      const Reader named = phase.Element("next", k);
      if (named.Enum("on") != kDone) continue;
      for (int j = 0; j < count; ++j) {
        if ((*phases)[static_cast<size_t>(j)].name == named.Text("to")) next = j;
      }
    }
  }
}

/// `text` as a message of `schema`; nullptr: the program does not link it, or the text is of
/// another version.
std::unique_ptr<Message> ReadAs(const char* schema, const std::string& text,
                                const std::string& source) {
  const auto* type =
      google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(schema);
  if (type == nullptr) return nullptr;
  std::unique_ptr<Message> message(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(type)->New());
  try {
    ParseTextProto(text, source, message.get());
  } catch (const ConfigError&) {
    return nullptr;
  }
  return message;
}

/// The configuration of who writes SUPPORT_PLAN; nullptr: there is none, or none that can be read.
std::unique_ptr<Message> PlannerConfig(const RunRecord& run) {
  const std::string component = WriterOf(run.spec.graph(), "support_plan_t");
  if (component.empty()) return nullptr;
  for (const ComponentConfig& config : run.spec.config()) {
    if (config.component() == component) return ReadAs(kSchema, config.text(), component);
  }
  return nullptr;
}

std::vector<WalkOrder> OrdersOf(const Reader& walk) {
  std::vector<WalkOrder> orders;
  if (!walk.Flag("enabled")) return orders;
  for (int i = 0; i < walk.Size("command"); ++i) {
    const Reader command = walk.Element("command", i);
    WalkOrder& order = orders.emplace_back();
    order.time = command.Real("time");
    order.after_steps = command.Whole("after_steps");
    if (command.Flag("stop")) continue;
    order.velocity = {command.Real("vx"), command.Real("vy"), command.Real("wz")};
  }
  return orders;
}

}  // namespace

std::optional<std::vector<PhasePlan>> ReadSchedulePlan(const RunRecord& run) {
  const std::unique_ptr<Message> message = PlannerConfig(run);
  if (message == nullptr) return {};  // the figures of such a log stand without the plan
  const Reader reader(*message);
  std::vector<PhasePlan> phases;
  for (int i = 0; i < reader.Size("phase"); ++i) {
    phases.push_back(ReadPhase(reader.Element("phase", i)));
  }
  LinkPhases(reader, &phases);
  return phases;
}

std::vector<WalkOrder> ReadWalkOrders(const RunRecord& run) {
  if (const auto scenario = ReadAs(kScenario, run.info.scenario, "the run's scenario")) {
    const Reader reader(*scenario);
    if (reader.Has("step_planner")) return OrdersOf(reader.Part("step_planner").Part("walk"));
  }
  const std::unique_ptr<Message> planner = PlannerConfig(run);
  return planner == nullptr ? std::vector<WalkOrder>() : OrdersOf(Reader(*planner).Part("walk"));
}

}  // namespace poise::logging
