// Typed ports: how a component reads and writes messages without seeing the bus.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "poise/message_traits.hpp"  // generated from lcmtypes

namespace poise {

/// How an input takes part in the join of its stage.
enum class InputKind {
  kSameTick,      ///< the message of this tick
  kPreviousTick,  ///< the message of the tick before (absent in tick 0): closes the loop through
                  ///< the robot
  kLatest,        ///< asynchronous: the latest message, if any; the stage never waits for it
};

/// Values of a message type's leading count fields (e.g. {num_joints, num_feet}), in their order.
/// Fixed for the life of a port, so that every message on it has one exact encoded size.
using MessageCounts = std::vector<int32_t>;
inline constexpr int32_t kMaxCount = 4096;  ///< of each

/// Type-erased input: what a runner needs. Not for components.
class InputPort {
 public:
  virtual ~InputPort() = default;
  virtual const char* type_name() const = 0;
  virtual int64_t fingerprint() const = 0;
  /// Names of the type's leading counts ("num_joints").
  virtual std::span<const char* const> count_names() const = 0;

  /// A message object of this port's type with its arrays sized; owned by the caller.
  virtual void* NewMessage() const = 0;
  virtual void DeleteMessage(void* message) const = 0;
  /// Copies between messages of this port's type and counts. Does not allocate.
  virtual void CopyMessage(const void* from, void* to) const = 0;
  /// Encoded size of every valid message of this port, bytes, fingerprint included.
  virtual int encoded_size() const = 0;
  /// Decodes into `message` (from NewMessage). Precondition: the raw checks of PacketFilter passed.
  /// Returns false when liblcm refuses it or a number in it is not finite. Does not allocate.
  virtual bool Decode(const uint8_t* data, int size, void* message) const = 0;
  /// Shows `message` to the component until the next call; nullptr: absent. The caller keeps it
  /// alive.
  virtual void Bind(const void* message) = 0;

  const std::string& name() const { return name_; }
  InputKind kind() const { return kind_; }
  const MessageCounts& counts() const { return counts_; }

 protected:
  friend class Wiring;
  std::string name_;
  InputKind kind_ = InputKind::kSameTick;
  MessageCounts counts_;
};

/// A component's view of one input. Declared with Wiring::AddInput.
template <class T>
class Input final : public InputPort {
  static_assert(MessageTraits<T>::kHasHeader && !MessageTraits<T>::kHasStrings,
                "a port's message has run_id, tick and utime, and one exact size");

 public:
  /// True when a message is there: in kSameTick inputs always, but at a deadline of real time.
  bool present() const { return message_ != nullptr; }
  /// Precondition: present().
  const T& operator*() const { return *message_; }
  const T* operator->() const { return message_; }

  const char* type_name() const override { return MessageTraits<T>::kName; }
  int64_t fingerprint() const override { return T::getHash(); }
  std::span<const char* const> count_names() const override {
    return MessageTraits<T>::kCountNames;
  }
  void* NewMessage() const override {
    auto* m = new T();
    MessageTraits<T>::Resize(*m, counts_);
    return m;
  }
  void DeleteMessage(void* message) const override { delete static_cast<T*>(message); }
  void CopyMessage(const void* from, void* to) const override {
    *static_cast<T*>(to) = *static_cast<const T*>(from);
  }
  int encoded_size() const override {
    T m;
    MessageTraits<T>::Resize(m, counts_);
    return m.getEncodedSize();
  }
  bool Decode(const uint8_t* data, int size, void* message) const override {
    auto& m = *static_cast<T*>(message);
    return m.decode(data, 0, size) == size && MessageTraits<T>::AllFinite(m);
  }
  void Bind(const void* message) override { message_ = static_cast<const T*>(message); }

 private:
  const T* message_ = nullptr;
};

/// Type-erased output. Not for components.
class OutputPort {
 public:
  virtual ~OutputPort() = default;
  virtual const char* type_name() const = 0;
  virtual int64_t fingerprint() const = 0;
  virtual std::span<const char* const> count_names() const = 0;
  virtual int encoded_size() const = 0;
  /// Encodes the current message; returns the bytes written or < 0. Does not allocate.
  virtual int Encode(uint8_t* buffer, int capacity) const = 0;
  virtual const void* message() const = 0;
  /// False when a number in the message is not finite: the runner then ends the run as failed,
  /// since no reader would accept the message.
  virtual bool Finite() const = 0;
  /// Stamps run, tick and time; the runner calls it before each stage.
  virtual void Stamp(int64_t run_id, int64_t tick, int64_t utime) = 0;

  /// Called in a tick, it keeps the message of this tick from being sent: in real time a stage may
  /// have nothing to say (a sensor did not answer). Never in lockstep, where readers wait for every
  /// tick.
  void Withhold() { withheld_ = true; }
  /// True once after Withhold.
  bool TakeWithheld() { return std::exchange(withheld_, false); }

  const std::string& name() const { return name_; }
  const MessageCounts& counts() const { return counts_; }

 protected:
  friend class Wiring;
  virtual void Allocate() = 0;
  std::string name_;
  MessageCounts counts_;

 private:
  bool withheld_ = false;
};

/// A component's view of one output: fill `*port` during the stage, the runner sends it when the
/// stage returns. The message keeps its values between ticks; counts, run_id, tick and utime are
/// set by the runner.
template <class T>
class Output final : public OutputPort {
  static_assert(MessageTraits<T>::kHasHeader && !MessageTraits<T>::kHasStrings,
                "a port's message has run_id, tick and utime, and one exact size");

 public:
  T& operator*() { return message_; }
  T* operator->() { return &message_; }

  const char* type_name() const override { return MessageTraits<T>::kName; }
  int64_t fingerprint() const override { return T::getHash(); }
  std::span<const char* const> count_names() const override {
    return MessageTraits<T>::kCountNames;
  }
  int encoded_size() const override { return message_.getEncodedSize(); }
  int Encode(uint8_t* buffer, int capacity) const override {
    return message_.encode(buffer, 0, capacity);
  }
  const void* message() const override { return &message_; }
  bool Finite() const override { return MessageTraits<T>::AllFinite(message_); }
  void Stamp(int64_t run_id, int64_t tick, int64_t utime) override {
    message_.run_id = run_id;
    message_.tick = tick;
    message_.utime = utime;
  }

 private:
  void Allocate() override { MessageTraits<T>::Resize(message_, counts_); }
  T message_{};
};

// The ports of Poise's own messages are instantiated in ports.cc: each component would compile them
// anew.
#define POISE_EXTERN_PORTS(T)     \
  extern template class Input<T>; \
  extern template class Output<T>;
POISE_PORT_MESSAGES(POISE_EXTERN_PORTS)
#undef POISE_EXTERN_PORTS

}  // namespace poise
