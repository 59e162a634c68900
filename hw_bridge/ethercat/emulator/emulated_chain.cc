#include "hw_bridge/ethercat/emulator/emulated_chain.h"

#include <algorithm>
#include <array>

#include "hw_bridge/ethercat/links/bytes.h"
#include "hw_bridge/ethercat/topology.h"

namespace poise::ethercat {
namespace {

enum class Addressing : uint8_t { kNone, kPosition, kStation, kBroadcast, kLogical };

/// What slaves do with a datagram.
struct CommandKind {
  Addressing addressing = Addressing::kNone;
  bool reads = false, writes = false;
  bool reads_one_writes_others = false;  ///< who is addressed puts in what the others take
};
constexpr CommandKind kCommands[kNumCommands] = {
    {},
    {Addressing::kPosition, true, false},
    {Addressing::kPosition, false, true},
    {Addressing::kPosition, true, true},
    {Addressing::kStation, true, false},
    {Addressing::kStation, false, true},
    {Addressing::kStation, true, true},
    {Addressing::kBroadcast, true, false},
    {Addressing::kBroadcast, false, true},
    {Addressing::kBroadcast, true, true},
    {Addressing::kLogical, true, false},
    {Addressing::kLogical, false, true},
    {Addressing::kLogical, true, true},
    {Addressing::kPosition, true, true, true},
    {Addressing::kStation, true, true, true},
};

}  // namespace

EmulatedChain::EmulatedChain(const EmulatedChainConfig& config, std::span<MotorLoad* const> loads)
    : config_(config),
      loads_(loads.begin(), loads.end()),
      behind_(static_cast<size_t>(config.drive_size()), {-1, -1, -1, -1}),
      port_times_(behind_.size()),
      connected_(behind_.size()) {
  for (size_t i = 0; i < behind_.size(); ++i) {
    slaves_.push_back(MakeSlave(i));
    if (i == 0) continue;
    const EmulatedDriveConfig& drive = config_.drive(static_cast<int>(i));
    const size_t parent = drive.has_behind() ? drive.behind() : i - 1;
    // A slave with swapped plugs goes on at its port 0.
    const bool swapped = parent < i && config_.drive(static_cast<int>(parent)).swapped();
    const size_t port = swapped && drive.port() == 1 ? 0 : drive.port();
    if (parent >= i || port >= kNumPorts || behind_[parent][port] >= 0) {
      throw EthercatError(
          "emulated slave {}: it cannot hang at port {} of slave {}: that is none before it, or "
          "the port is taken",
          i, port, parent);
    }
    behind_[parent][port] = static_cast<int>(i);
  }
  FindWay();
}

std::unique_ptr<EmulatedSlave> EmulatedChain::MakeSlave(size_t slave) const {
  return std::make_unique<EmulatedSlave>(config_.drive(static_cast<int>(slave)), loads_[slave]);
}

int64_t EmulatedChain::Walk(size_t slave, int64_t arrival) {
  const bool swapped = config_.drive(static_cast<int>(slave)).swapped();
  const size_t entry = swapped ? 2 : 0;  // place of port 1 or port 0 in the frame's order
  auto& times = port_times_[slave];
  times = {};
  times[static_cast<size_t>(kFrameOrder[entry])] = arrival;
  int64_t time = arrival;
  if (!swapped) way_.push_back({slave, time});
  for (size_t i = 1; i < kNumPorts; ++i) {
    const auto port = static_cast<size_t>(kFrameOrder[(entry + i) % kNumPorts]);
    const int next = behind_[slave][port];
    if (next >= 0 && static_cast<size_t>(next) < connected_) {
      time = Walk(static_cast<size_t>(next), time + config_.hop()) + config_.hop();
      times[port] = time;
    }
    // The processing unit is behind port 0.
    if (port == 0) way_.push_back({slave, time});
  }
  return time;
}

void EmulatedChain::FindWay() {
  way_.clear();
  if (connected_ > 0 && !slaves_.empty()) Walk(0, 0);
  for (size_t i = 0; i < slaves_.size(); ++i) {
    std::array<bool, kNumPorts> linked{};
    for (size_t port = 0; port < kNumPorts; ++port) {
      const int next = behind_[i][port];
      // The slaves beyond a cut are still linked with each other.
      const bool same_side = (static_cast<size_t>(next) < connected_) == (i < connected_);
      linked[port] = next >= 0 && same_side;
    }
    const bool swapped = config_.drive(static_cast<int>(i)).swapped();
    linked[swapped ? 1 : 0] = i != connected_ || connected_ == slaves_.size();
    slaves_[i]->esc().SetPorts(linked);
  }
}

void EmulatedChain::CutAfter(size_t count) {
  if (count == connected_) return;
  connected_ = count;
  FindWay();
}

void EmulatedChain::PowerOff(size_t slave) {
  slaves_[slave] = MakeSlave(slave);
  slaves_[slave]->AdvanceTo(now_);  // its motor is without torque
  CutAfter(slave);
}

void EmulatedChain::PowerOn(size_t slave) {
  slaves_[slave] = MakeSlave(slave);
  slaves_[slave]->AdvanceTo(now_);
  connected_ = slaves_.size();
  FindWay();
}

void EmulatedChain::AdvanceTo(int64_t now) {
  now_ = std::max(now, now_);
  for (const auto& slave : slaves_) slave->AdvanceTo(now);
}

bool EmulatedChain::HandleFrame(std::span<uint8_t> frame, int64_t now) {
  FrameReader reader(frame);
  if (!reader.valid()) {
    ++refused_;
    return false;
  }
  ++frames_;
  while (const std::optional<Datagram> datagram = reader.Next()) {
    const std::span<uint8_t> bytes =
        frame.subspan(datagram->offset, kDatagramOverhead + datagram->data.size());
    for (const Visit& visit : way_) {
      EmulatedSlave* slave = slaves_[visit.slave].get();
      if (!slave->silent()) Process(*datagram, bytes, slave, now + visit.time);
    }
    if (datagram->command == Command::kBwr && datagram->ado == reg::kDcReceiveTime) {
      LatchReceiveTimes(now);
    }
  }
  const auto turn = static_cast<int64_t>(slaves_.size()) * config_.hop();
  AdvanceTo(now + turn);
  return true;
}

void EmulatedChain::LatchReceiveTimes(int64_t now) {
  for (const Visit& visit : way_) {
    if (slaves_[visit.slave]->silent()) continue;
    std::array<std::optional<int64_t>, kNumPorts> ports = port_times_[visit.slave];
    for (std::optional<int64_t>& port : ports) {
      if (port) *port += now;
    }
    slaves_[visit.slave]->esc().LatchReceiveTimes(ports, now + visit.time);
  }
}

void EmulatedChain::Process(const Datagram& datagram, std::span<uint8_t> bytes,
                            EmulatedSlave* slave, int64_t now) {
  EmulatedEsc& esc = slave->esc();
  const std::span<uint8_t> data = bytes.subspan(kDatagramHeader, datagram.data.size());
  const size_t counter_at = kDatagramHeader + data.size();
  // The address as it is at this slave, changed by those before.
  const auto adp = Get<uint16_t>(bytes, 2);

  const CommandKind& kind = kCommands[static_cast<size_t>(datagram.command)];
  if (kind.addressing == Addressing::kNone) return;
  bool read = kind.reads, write = kind.writes, was_read = false, was_written = false;
  if (kind.addressing == Addressing::kLogical) {
    const EmulatedEsc::Access access =
        esc.Logical(datagram.logical_address(), data, read, write, now);
    was_read = access.read;
    was_written = access.written;
  } else {
    const bool broadcast = kind.addressing == Addressing::kBroadcast;
    const bool addressed =
        broadcast || (kind.addressing == Addressing::kPosition ? adp == 0 : esc.HasAddress(adp));
    read = read && addressed;
    write = write && (kind.reads_one_writes_others ? !addressed : addressed);
    if (kind.addressing != Addressing::kStation) {
      Put<uint16_t>(bytes, 2, static_cast<uint16_t>(adp + 1));
    }
    std::array<uint8_t, kMaxDatagramData> found;
    const std::span<uint8_t> old = std::span(found).first(data.size());
    was_read = read && esc.Read(datagram.ado, old, now);
    was_written = write && esc.Write(datagram.ado, data, now);
    for (size_t i = 0; was_read && i < data.size(); ++i) {
      data[i] = static_cast<uint8_t>(broadcast ? data[i] | old[i] : old[i]);
    }
  }
  const auto counter = Get<uint16_t>(bytes, counter_at);
  Put<uint16_t>(bytes, counter_at,
                static_cast<uint16_t>(counter + (was_read ? 1 : 0) +
                                      (was_written ? (read && write ? 2 : 1) : 0)));
}

}  // namespace poise::ethercat
