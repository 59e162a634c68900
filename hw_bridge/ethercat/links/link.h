// Link: carries EtherCAT frames between a master and its chain of slaves, and tells the time.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <span>
#include <stdexcept>
#include <utility>

namespace poise::ethercat {

/// The bus cannot be opened or started, or does not match its configuration. what() is one line
/// that names the slave, register or object, and the remedy. Never thrown in cyclic operation.
class EthercatError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  template <class Arg, class... Args>
  explicit EthercatError(fmt::format_string<Arg, Args...> text, Arg&& arg, Args&&... args)
      : std::runtime_error(fmt::format(text, std::forward<Arg>(arg), std::forward<Args>(args)...)) {
  }
};

inline constexpr int64_t kMillisecond = 1'000'000;  // ns
inline constexpr int64_t kSecond = 1'000'000'000;   // ns

/// No call allocates or throws. Frames start at the EtherCAT header.
class Link {
 public:
  virtual ~Link() = default;
  Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// ns, monotonic, of the clock that deadlines are in.
  virtual int64_t Now() const = 0;
  /// False when the frame could not be sent.
  virtual bool Send(std::span<const uint8_t> frame) = 0;
  /// Waits until `deadline` at most (in the past: looks once) for a frame and copies what fits.
  /// Its size; 0 when none came.
  virtual size_t Receive(std::span<uint8_t> frame, int64_t deadline) = 0;
};

/// What stands at the other end of a link: slaves that change frames as they pass.
class FrameHandler {
 public:
  virtual ~FrameHandler() = default;
  /// Lets time pass, also without frames. `now` never decreases.
  virtual void AdvanceTo(int64_t now) = 0;
  /// Processes a frame in place. False: it is no EtherCAT frame and stays as it is.
  virtual bool HandleFrame(std::span<uint8_t> frame, int64_t now) = 0;
};

}  // namespace poise::ethercat
