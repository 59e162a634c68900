#include "components/messages/foreign_component.h"

#include <utility>

#include "components/messages/robot_resource.h"
#include "fmt/format.h"

namespace poise {

/// An input or output of one message type.
struct ForeignComponent::Carrier {
  virtual ~Carrier() = default;
  virtual InputPort* input() = 0;
  virtual OutputPort* output() = 0;
  virtual bool present() const = 0;
  virtual void EncodeInput(std::vector<uint8_t>* bytes) const = 0;
  virtual bool DecodeOutput(const std::vector<uint8_t>& bytes) = 0;
  virtual std::span<const char* const> count_names() const = 0;
};

template <class T>
struct ForeignComponent::TypedCarrier final : Carrier {
  InputPort* input() override { return &in; }
  OutputPort* output() override { return &out; }
  bool present() const override { return in.present(); }
  void EncodeInput(std::vector<uint8_t>* bytes) const override {
    in->encode(bytes->data(), 0, static_cast<int>(bytes->size()));
  }
  bool DecodeOutput(const std::vector<uint8_t>& bytes) override {
    const int size = static_cast<int>(bytes.size());
    return out->decode(bytes.data(), 0, size) == size;
  }
  std::span<const char* const> count_names() const override {
    return MessageTraits<T>::kCountNames;
  }

  Input<T> in;
  Output<T> out;
};

std::unique_ptr<ForeignComponent::Carrier> ForeignComponent::MakeCarrier(const std::string& type) {
  std::unique_ptr<Carrier> carrier;
  ForEachMessageType([&]<class T>() {
    if constexpr (MessageTraits<T>::kHasHeader && !MessageTraits<T>::kHasStrings) {
      if (type == MessageTraits<T>::kName) carrier = std::make_unique<TypedCarrier<T>>();
    }
  });
  return carrier;
}

ForeignComponent::ForeignComponent(std::vector<PortType> ports,
                                   std::shared_ptr<ForeignFunctions> functions)
    : declared_(std::move(ports)), functions_(std::move(functions)) {}

ForeignComponent::~ForeignComponent() = default;

void ForeignComponent::Configure(const ComponentContext& context, Wiring* wiring) {
  const std::shared_ptr<const robot::RobotModel> robot = LoadRobot(context);
  std::vector<InputPort*> inputs;
  std::vector<OutputPort*> outputs;
  for (const PortType& port : declared_) {
    std::unique_ptr<Carrier> carrier = MakeCarrier(port.type);
    if (!carrier) {
      throw ConfigError(
          fmt::format("port {}: {} is no message that such a component can carry; "
                      "poise list messages shows them",
                      port.name, port.type));
    }
    MessageCounts counts;
    for (const std::string_view name : carrier->count_names()) {
      if (name == "num_joints" || name == "num_motors") {
        counts.push_back(robot->num_joints());
      } else if (name == "num_feet") {
        counts.push_back(static_cast<int32_t>(robot->feet().size()));
      } else {
        throw ConfigError(
            fmt::format("port {}: the robot does not tell {} of {}", port.name, name, port.type));
      }
    }
    if (port.input) {
      wiring->AddInput(carrier->input(), port.name, counts, port.kind);
      inputs.push_back(carrier->input());
    } else {
      wiring->AddOutput(carrier->output(), port.name, counts);
      outputs.push_back(carrier->output());
    }
    const int size =
        port.input ? carrier->input()->encoded_size() : carrier->output()->encoded_size();
    ports_.push_back({port, counts, false, std::vector<uint8_t>(static_cast<size_t>(size))});
    carriers_.push_back(std::move(carrier));
  }
  functions_->Configure(context, ports_);
  wiring->AddStage("step", inputs, outputs, [this](const Tick& tick) { Step(tick); });
}

void ForeignComponent::Step(const Tick& tick) {
  if (error_) return;
  try {
    for (size_t i = 0; i < ports_.size(); ++i) {
      ForeignPort& port = ports_[i];
      if (port.port.input) {
        port.present = carriers_[i]->present();
        if (port.present) carriers_[i]->EncodeInput(&port.bytes);
      } else {
        // The header of this tick, and the values of the last.
        carriers_[i]->output()->Encode(port.bytes.data(), static_cast<int>(port.bytes.size()));
      }
    }
    functions_->Step(tick, ports_);
    for (size_t i = 0; i < ports_.size(); ++i) {
      if (ports_[i].port.input || carriers_[i]->DecodeOutput(ports_[i].bytes)) continue;
      throw ConfigError(
          fmt::format("output {}: its bytes are no {}", ports_[i].port.name, ports_[i].port.type));
    }
  } catch (const std::exception& error) {
    error_ = std::current_exception();
    finished_ = error.what();
    failed_ = true;
  }
}

namespace {

class Elsewhere : public ForeignFunctions {
 public:
  explicit Elsewhere(std::string name) : name_(std::move(name)) {}
  void Configure(const ComponentContext&, std::span<const ForeignPort>) override {}
  void Step(const Tick&, std::span<ForeignPort>) override {
    throw ConfigError(
        fmt::format("{} is a program of its own, which no other process holds", name_));
  }

 private:
  std::string name_;
};

}  // namespace

ComponentType ProgramType(std::string name, std::string summary, std::vector<PortType> ports) {
  ComponentType type;
  type.name = name;
  type.summary = std::move(summary);
  type.ports = ports;
  type.make = [name = std::move(name), ports = std::move(ports)] {
    return std::make_unique<ForeignComponent>(ports, std::make_shared<Elsewhere>(name));
  };
  return type;
}

}  // namespace poise
