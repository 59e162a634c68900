#include "hw_bridge/ethercat/distributed_clocks.h"

#include <fmt/format.h>

#include <algorithm>

namespace poise::ethercat {
namespace {

constexpr uint8_t kHasClock = 0x04, kHas64Bits = 0x08;  // of register 0x0008
constexpr uint16_t kPort1Open = 0x0800;                 // of the DL status: communication on port 1
constexpr int64_t kSync0Lead = 100 * kMillisecond;      // between setting SYNC0 and its first pulse

}  // namespace

std::vector<int32_t> PropagationDelays(std::span<const DcTimes> times) {
  // Modulo 2^32, as the 32-bit clocks count.
  const auto round_trip = [](const DcTimes& slave) {
    return slave.last ? 0U : slave.port1 - slave.port0;
  };
  std::vector<int32_t> delays(times.size(), 0);
  for (size_t i = 1; i < times.size(); ++i) {
    const auto difference = static_cast<int32_t>(round_trip(times[i - 1]) - round_trip(times[i]));
    delays[i] = delays[i - 1] + difference / 2;
  }
  return delays;
}

void SetUpClocks(Transactions* transactions, std::span<SlaveAccess> slaves, int64_t epoch) {
  for (SlaveAccess& slave : slaves) {
    const auto features = slave.Read<uint8_t>(reg::kFeatures);
    if ((features & kHasClock) == 0 || (features & kHas64Bits) == 0) {
      throw EthercatError(fmt::format(
          "{}: has no 64-bit distributed clock; set distributed_clocks: false", slave.Describe()));
    }
  }
  std::array<uint8_t, 4> latch{};
  const auto counter = transactions->Execute(Command::kBwr, 0, reg::kDcReceiveTime, latch);
  if (!counter || *counter != slaves.size()) {
    throw EthercatError(fmt::format("latching the slaves' clocks reached {} of {} slaves",
                                    counter.value_or(0), slaves.size()));
  }
  std::vector<DcTimes> times;
  for (SlaveAccess& slave : slaves) {
    times.push_back({.port0 = slave.Read<uint32_t>(reg::kDcReceiveTime),
                     .port1 = slave.Read<uint32_t>(reg::kDcReceiveTime + 4),
                     .last = (slave.Read<uint16_t>(reg::kDlStatus) & kPort1Open) == 0,
                     .unit = slave.Read<int64_t>(reg::kDcReceiveTimeUnit)});
  }
  const std::vector<int32_t> delays = PropagationDelays(times);
  for (size_t i = 0; i < slaves.size(); ++i) {
    slaves[i].Write<uint32_t>(reg::kDcDelay, static_cast<uint32_t>(delays[i]));
    slaves[i].Write<int64_t>(reg::kDcOffset, epoch + delays[i] - times[i].unit);
    // Writing the start value resets the filters of the clock's control loop.
    slaves[i].Write<uint16_t>(reg::kDcSpeedStart, slaves[i].Read<uint16_t>(reg::kDcSpeedStart));
  }
}

void StartSync0(std::span<SlaveAccess> slaves, uint32_t cycle, int32_t shift) {
  const auto period = static_cast<int64_t>(cycle);
  for (SlaveAccess& slave : slaves) {
    slave.Write<uint8_t>(reg::kDcActivation, 0);
    slave.Write<uint8_t>(reg::kDcCyclicUnit, 0);  // the master's
    const auto now = slave.Read<int64_t>(reg::kDcSystemTime);
    const int64_t start = (now + kSync0Lead) / period * period + period + shift;
    slave.Write<int64_t>(reg::kDcStart, start);
    slave.Write<uint32_t>(reg::kDcSync0Cycle, cycle);
    slave.Write<uint8_t>(reg::kDcActivation, 0x03);  // cyclic unit and SYNC0
  }
}

int64_t CycleSteering::Update(int64_t system_time) {
  int64_t error = system_time % cycle_;
  if (error < 0) error += cycle_;
  if (error > cycle_ / 2) error -= cycle_;
  phase_error_ = error;
  // Gains for a well-damped loop (damping ratio 1.4 at one correction a cycle): slow enough that
  // the jitter of a frame hardly moves the cycle.
  constexpr double kProportional = 1.0 / 16, kIntegral = 1.0 / 2048;
  const double limit = 0.01 * static_cast<double>(cycle_);
  integral_ = std::clamp(integral_ + kIntegral * static_cast<double>(error), -limit, limit);
  const double wanted = kProportional * static_cast<double>(error) + integral_;
  return -static_cast<int64_t>(std::clamp(wanted, -limit, limit));
}

}  // namespace poise::ethercat
