#include "components/framework/component.h"

#include <algorithm>

#include "fmt/format.h"

namespace poise {
namespace {

void CheckCounts(std::string_view direction, const std::string& name,
                 std::span<const char* const> count_names, const MessageCounts& counts) {
  if (counts.size() != count_names.size()) {
    throw ConfigError(fmt::format("{} {}: its type has {} counts, {} given", direction, name,
                                  count_names.size(), counts.size()));
  }
  for (size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] < 0 || counts[i] > kMaxCount) {
      throw ConfigError(fmt::format("{} {}: {} = {} is outside 0 to {}", direction, name,
                                    count_names[i], counts[i], kMaxCount));
    }
  }
}

template <class Port>
void CheckName(std::string_view direction, const std::string& name,
               const std::vector<Port*>& ports) {
  for (const Port* port : ports) {
    if (port->name() == name)
      throw ConfigError(fmt::format("{} {} is declared twice", direction, name));
  }
}

}  // namespace

const std::string& ComponentContext::resource(const std::string& resource_name) const {
  if (resources != nullptr) {
    const auto found = resources->find(resource_name);
    if (found != resources->end()) return found->second;
  }
  throw ConfigError(fmt::format(
      "component {} needs the resource '{}', which this run does not have", name, resource_name));
}

void Wiring::AddInput(InputPort* port, std::string name, MessageCounts counts, InputKind kind) {
  CheckName("input", name, inputs_);
  CheckCounts("input", name, port->count_names(), counts);
  port->name_ = std::move(name);
  port->counts_ = std::move(counts);
  port->kind_ = kind;
  inputs_.push_back(port);
}

void Wiring::AddOutput(OutputPort* port, std::string name, MessageCounts counts) {
  CheckName("output", name, outputs_);
  CheckCounts("output", name, port->count_names(), counts);
  port->name_ = std::move(name);
  port->counts_ = std::move(counts);
  port->Allocate();
  outputs_.push_back(port);
}

void Wiring::AddStage(std::string name, std::vector<InputPort*> inputs,
                      std::vector<OutputPort*> outputs, std::function<void(const Tick&)> run,
                      double deadline) {
  if (!(deadline >= 0 && deadline <= 1)) {
    throw ConfigError(
        fmt::format("stage {}: its deadline is {} of the period; 0 to 1", name, deadline));
  }
  for (const InputPort* input : inputs) {
    if (std::find(inputs_.begin(), inputs_.end(), input) == inputs_.end()) {
      throw ConfigError(fmt::format("stage {}: an input of it was not added before", name));
    }
  }
  for (const OutputPort* output : outputs) {
    if (std::find(outputs_.begin(), outputs_.end(), output) == outputs_.end()) {
      throw ConfigError(fmt::format("stage {}: an output of it was not added before", name));
    }
    for (const Stage& stage : stages_) {
      if (std::find(stage.outputs.begin(), stage.outputs.end(), output) != stage.outputs.end()) {
        throw ConfigError(fmt::format("output {} belongs to the stages {} and {}; one only",
                                      output->name(), stage.name, name));
      }
    }
  }
  stages_.push_back(
      {std::move(name), std::move(inputs), std::move(outputs), std::move(run), deadline});
}

}  // namespace poise
