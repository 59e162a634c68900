// A component whose stage is a function outside C++: its messages come and go encoded.
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "components/framework/component.h"
#include "components/framework/component_type.h"

namespace poise {

/// A port of a foreign component with the message of this tick.
struct ForeignPort {
  PortType port;
  MessageCounts counts;        ///< those of the run's robot
  bool present = false;        ///< of an input: whether there is a message
  std::vector<uint8_t> bytes;  ///< the message, encoded; an output's as it was after the last stage
};

/// What a foreign component does.
class ForeignFunctions {
 public:
  virtual ~ForeignFunctions() = default;
  /// Ports in the order of the type's. Throws ConfigError.
  virtual void Configure(const ComponentContext& context, std::span<const ForeignPort> ports) = 0;
  /// Changes the outputs' bytes, but for their counts and header. What it throws ends the run.
  virtual void Step(const Tick& tick, std::span<ForeignPort> ports) = 0;
};

/// One stage "step" with all ports. Counts are the robot's: num_joints, num_motors, num_feet.
/// Allocates in the tick path and throws nothing there.
class ForeignComponent : public Component {
 public:
  /// `ports`: of Poise's own messages with a header and without texts.
  ForeignComponent(std::vector<PortType> ports, std::shared_ptr<ForeignFunctions> functions);
  ~ForeignComponent() override;
  /// Throws ConfigError for a message that it cannot carry.
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  std::string_view finished() const override { return finished_; }
  bool failed() const override { return failed_; }
  /// Ends the component without a failure: finished() gives `why` from now on.
  void Finish(std::string why) { finished_ = std::move(why); }
  /// What Step of the functions threw; nullptr: nothing.
  std::exception_ptr error() const { return error_; }

 private:
  struct Carrier;
  template <class T>
  struct TypedCarrier;

  static std::unique_ptr<Carrier> MakeCarrier(const std::string& type);
  void Step(const Tick& tick);

  std::vector<PortType> declared_;
  std::shared_ptr<ForeignFunctions> functions_;
  std::vector<std::unique_ptr<Carrier>> carriers_;
  std::vector<ForeignPort> ports_;
  std::string finished_;
  bool failed_ = false;
  std::exception_ptr error_;
};

/// A type whose program runs elsewhere: its ports alone are known. In one process it ends the run
/// in its first tick, saying so.
ComponentType ProgramType(std::string name, std::string summary, std::vector<PortType> ports);

}  // namespace poise
