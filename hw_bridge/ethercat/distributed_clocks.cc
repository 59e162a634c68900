#include "hw_bridge/ethercat/distributed_clocks.h"

#include <algorithm>

namespace poise::ethercat {
namespace {

constexpr int64_t kSync0Lead = 100 * kMillisecond;  // between setting SYNC0 and its first pulse
constexpr uint16_t kSpeedStart = 0x1000;            // an ESC's default, which resets the loop
constexpr uint8_t kTimeFilter = 0x00, kSpeedFilter = 0x0C;  // an ESC's defaults

void SetUpClock(SlaveAccess* slave, int32_t delay, int64_t offset) {
  slave->Write<uint32_t>(reg::kDcDelay, static_cast<uint32_t>(delay));
  slave->Write<int64_t>(reg::kDcOffset, offset);
  slave->Write<uint16_t>(reg::kDcSpeedStart, kSpeedStart);
  slave->Write<uint8_t>(reg::kDcTimeFilter, kTimeFilter);
  slave->Write<uint8_t>(reg::kDcSpeedFilter, kSpeedFilter);
}

}  // namespace

void LatchClocks(Transactions* transactions) {
  std::array<uint8_t, 4> latch{};
  if (!transactions->Execute(Command::kBwr, 0, reg::kDcReceiveTime, latch)) {
    throw EthercatError("latching the slaves' clocks: no frame came back");
  }
}

void SetUpClocks(Transactions* transactions, std::span<SlaveAccess* const> slaves,
                 std::span<const int32_t> delays, int64_t epoch) {
  LatchClocks(transactions);
  for (size_t i = 0; i < slaves.size(); ++i) {
    const auto unit = slaves[i]->Read<int64_t>(reg::kDcReceiveTimeUnit);
    SetUpClock(slaves[i], delays[i], epoch + delays[i] - unit);
  }
}

void JoinClock(Transactions* transactions, SlaveAccess* reference, SlaveAccess* slave,
               int32_t delay) {
  LatchClocks(transactions);
  const auto time = static_cast<uint64_t>(reference->Read<int64_t>(reg::kDcReceiveTimeUnit)) +
                    static_cast<uint64_t>(reference->Read<int64_t>(reg::kDcOffset));
  const auto unit = static_cast<uint64_t>(slave->Read<int64_t>(reg::kDcReceiveTimeUnit));
  // Modulo 2^64, as the clocks count.
  SetUpClock(slave, delay,
             static_cast<int64_t>(time + static_cast<uint64_t>(int64_t{delay}) - unit));
}

void StartSync0(SlaveAccess* slave, uint32_t cycle) {
  const auto period = static_cast<int64_t>(cycle);
  slave->Write<uint8_t>(reg::kDcActivation, 0);
  slave->Write<uint8_t>(reg::kDcCyclicUnit, 0);  // the master's
  const auto now = slave->Read<int64_t>(reg::kDcSystemTime);
  const int64_t start = (now + kSync0Lead) / period * period + period + period / 2;
  slave->Write<int64_t>(reg::kDcStart, start);
  slave->Write<uint32_t>(reg::kDcSync0Cycle, cycle);
  slave->Write<uint8_t>(reg::kDcActivation, 0x03);  // cyclic unit and SYNC0
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
