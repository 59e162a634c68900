// Components written in Python, in this process or as a program of a run.
#include <algorithm>
#include <cstring>

#include "components/framework/runners/component_main.h"
#include "fmt/format.h"
#include "python/bindings/bindings.h"

namespace poise::python {
namespace {

/// The arrays that a component fills: one a field, kept between ticks.
struct Outgoing {
  MessageLayout layout;
  std::vector<std::pair<const Leaf*, py::array>> arrays;  // not of counts and header
};

class PythonFunctions : public ForeignFunctions {
 public:
  explicit PythonFunctions(py::object component) : component_(std::move(component)) {}
  ~PythonFunctions() override {
    const py::gil_scoped_acquire acquired;
    outgoing_.clear();
    outputs_.release().dec_ref();
    component_.release().dec_ref();
  }

  void Configure(const ComponentContext& context, std::span<const ForeignPort> ports) override {
    const py::gil_scoped_acquire acquired;
    py::dict given;
    given["name"] = context.name;
    given["tick_period"] = context.tick_period;
    given["lead_ticks"] = context.lead_ticks;
    given["seed"] = context.seed;
    given["robot_texts"] = py::make_tuple(context.resource("robot"), context.resource("urdf"));
    py::dict outputs;
    layouts_.clear();
    outgoing_.clear();
    for (const ForeignPort& port : ports) {
      const MessageType& type = *FindMessageType(port.port.type);
      layouts_.push_back(std::make_shared<MessageLayout>(type, port.counts));
      outgoing_.push_back(nullptr);
      if (port.port.input) continue;
      auto out = std::make_unique<Outgoing>(Outgoing{*layouts_.back(), {}});
      py::dict fields;
      for (const Leaf& leaf : out->layout.leaves()) {
        const bool header =
            leaf.path == "run_id" || leaf.path == "tick" || leaf.path == "utime" ||
            std::ranges::find(type.count_names, leaf.path) != type.count_names.end();
        if (header) continue;
        py::array array = NewArray(leaf, -1);
        std::memset(array.mutable_data(), 0, static_cast<size_t>(array.nbytes()));
        fields[py::str(leaf.path)] = array;
        out->arrays.emplace_back(&leaf, array);
      }
      outputs[py::str(port.port.name)] = fields;
      outgoing_.back() = std::move(out);
    }
    outputs_ = component_.attr("_configure")(given, outputs);
  }

  void Step(const Tick& tick, std::span<ForeignPort> ports) override {
    const py::gil_scoped_acquire acquired;
    py::dict inputs;
    for (size_t i = 0; i < ports.size(); ++i) {
      if (!ports[i].port.input) continue;
      const py::str name(ports[i].port.name);
      if (ports[i].present) {
        inputs[name] = Message{ports[i].bytes, layouts_[i], ports[i].port.type};
      } else {
        inputs[name] = py::none();
      }
    }
    component_.attr("_step")(py::make_tuple(tick.index, tick.utime, tick.time), inputs, outputs_);
    for (size_t i = 0; i < ports.size(); ++i) {
      if (!outgoing_[i]) continue;
      for (const auto& [leaf, array] : outgoing_[i]->arrays) {
        // Whoever resized it would have us read beyond its end.
        if (static_cast<size_t>(array.nbytes()) != SizeOf(leaf->number) * leaf->elements.size()) {
          throw ConfigError(
              fmt::format("output {}: its array {} was resized", ports[i].port.name, leaf->path));
        }
        MessageLayout::Write(*leaf, array.data(), ports[i].bytes.data());
      }
    }
  }

 private:
  py::object component_;
  py::object outputs_ = py::none();
  std::vector<std::shared_ptr<const MessageLayout>> layouts_;
  std::vector<std::unique_ptr<Outgoing>> outgoing_;
};

using Ports = std::vector<std::tuple<std::string, std::string, std::string>>;

std::vector<PortType> PortsOf(const Ports& inputs, const Ports& outputs) {
  std::vector<PortType> ports;
  for (const auto& [name, type, kind] : inputs) {
    const InputKind of =
        kind == "same tick"     ? InputKind::kSameTick
        : kind == "tick before" ? InputKind::kPreviousTick
        : kind == "latest"
            ? InputKind::kLatest
            : throw ConfigError(fmt::format("input {}: kind '{}' is none of: same tick, "
                                            "tick before, latest",
                                            name, kind));
    ports.push_back({name, type, true, of});
  }
  for (const auto& [name, type, kind] : outputs) {
    ports.push_back({name, type, false, InputKind::kSameTick});
  }
  return ports;
}

/// main() of a program that is one component; returns its exit code.
int Main(const std::vector<std::string>& arguments, const std::string& name,
         const std::string& summary, const Ports& inputs, const Ports& outputs,
         const py::object& make) {
  ComponentType type;
  type.name = name;
  type.summary = summary;
  type.ports = PortsOf(inputs, outputs);
  type.make = [ports = type.ports, &make] {
    return std::make_unique<ForeignComponent>(ports, FunctionsOf(make()));
  };
  std::vector<std::string> kept = arguments;
  std::vector<char*> argv;
  for (std::string& argument : kept) argv.push_back(argument.data());
  argv.push_back(nullptr);
  return ComponentMain(static_cast<int>(kept.size()), argv.data(), type);
}

/// The numbers of one field. Throws KeyError.
py::object Get(const Message& message, const std::string& path) {
  const Leaf* const leaf = message.layout->Find(path);
  if (leaf == nullptr) {
    throw py::key_error(fmt::format("{} has no field '{}'", message.type, path));
  }
  py::array array = NewArray(*leaf, -1);
  MessageLayout::Read(*leaf, message.bytes.data(), array.mutable_data());
  return leaf->shape.empty() ? array.attr("item")() : py::object(array);
}

}  // namespace

std::shared_ptr<ForeignFunctions> FunctionsOf(py::object component) {
  return std::make_shared<PythonFunctions>(std::move(component));
}

void BindComponent(py::module_* module) {
  py::class_<Message>(*module, "Message")
      .def("get", &Get)
      .def_property_readonly("type", [](const Message& message) { return message.type; })
      .def("fields", [](const Message& message) {
        std::vector<std::pair<std::string, std::vector<int64_t>>> fields;
        for (const Leaf& leaf : message.layout->leaves())
          fields.emplace_back(leaf.path, leaf.shape);
        return fields;
      });
  module->def("component_main", &Main);
}

}  // namespace poise::python
