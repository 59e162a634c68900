#include "hw_bridge/ethercat/emulator/emulated_chain.h"

#include <algorithm>
#include <array>

#include "hw_bridge/ethercat/bytes.h"

namespace poise::ethercat {

EmulatedChain::EmulatedChain(const EmulatedChainConfig& config, std::span<MotorLoad* const> loads)
    : hop_(config.hop()), connected_(static_cast<size_t>(config.drive_size())) {
  for (int i = 0; i < config.drive_size(); ++i) {
    slaves_.push_back(std::make_unique<EmulatedSlave>(config.drive(i), i + 1 == config.drive_size(),
                                                      loads[static_cast<size_t>(i)]));
  }
}

void EmulatedChain::AdvanceTo(int64_t now) {
  for (const auto& slave : slaves_) slave->AdvanceTo(now);
}

bool EmulatedChain::HandleFrame(std::span<uint8_t> frame, int64_t now) {
  FrameReader reader(frame);
  if (reader.error() != FrameError::kNone) {
    ++refused_[static_cast<size_t>(reader.error())];
    return false;
  }
  ++frames_;
  while (const std::optional<Datagram> datagram = reader.Next()) {
    const std::span<uint8_t> bytes =
        frame.subspan(datagram->offset, kDatagramOverhead + datagram->data.size());
    for (size_t i = 0; i < std::min(connected_, slaves_.size()); ++i) {
      if (slaves_[i]->silent()) continue;
      Process(*datagram, bytes, slaves_[i].get(), now + static_cast<int64_t>(i) * hop_);
    }
    if (datagram->command == Command::kBwr && datagram->ado == reg::kDcReceiveTime) {
      LatchReceiveTimes(now);
    }
  }
  const auto turn = static_cast<int64_t>(slaves_.size()) * hop_;
  AdvanceTo(now + turn);
  return true;
}

void EmulatedChain::LatchReceiveTimes(int64_t now) {
  const size_t count = std::min(connected_, slaves_.size());
  for (size_t i = 0; i < count; ++i) {
    const int64_t out = now + static_cast<int64_t>(i) * hop_;
    const int64_t back = now + static_cast<int64_t>(2 * (count - 1) - i) * hop_;
    if (!slaves_[i]->silent()) slaves_[i]->esc().LatchReceiveTimes(out, back);
  }
}

void EmulatedChain::Process(const Datagram& datagram, std::span<uint8_t> bytes,
                            EmulatedSlave* slave, int64_t now) {
  EmulatedEsc& esc = slave->esc();
  const std::span<uint8_t> data = bytes.subspan(kDatagramHeader, datagram.data.size());
  const size_t counter_at = kDatagramHeader + data.size();
  // The address as it is at this slave, changed by those before.
  const auto adp = Get<uint16_t>(bytes, 2);
  std::array<uint8_t, 2> station_bytes{};
  static_cast<void>(esc.Read(reg::kStationAddress, station_bytes, now));
  const auto station = Get<uint16_t>(station_bytes, 0);

  bool read = false, write = false, merge = false;
  switch (datagram.command) {
    case Command::kNop:
      return;
    case Command::kAprd:
    case Command::kApwr:
    case Command::kAprw:
      read = adp == 0 && datagram.command != Command::kApwr;
      write = adp == 0 && datagram.command != Command::kAprd;
      break;
    case Command::kFprd:
    case Command::kFpwr:
    case Command::kFprw:
      read = adp == station && datagram.command != Command::kFpwr;
      write = adp == station && datagram.command != Command::kFprd;
      break;
    case Command::kBrd:
    case Command::kBwr:
    case Command::kBrw:
      read = merge = datagram.command != Command::kBwr;
      write = datagram.command != Command::kBrd;
      break;
    case Command::kArmw:
      read = adp == 0;
      write = !read;
      break;
    case Command::kFrmw:
      read = adp == station;
      write = !read;
      break;
    case Command::kLrd:
    case Command::kLwr:
    case Command::kLrw: {
      const bool reads = datagram.command != Command::kLwr;
      const bool writes = datagram.command != Command::kLrd;
      const EmulatedEsc::Access access =
          esc.Logical(datagram.logical_address(), data, reads, writes, now);
      const int both = reads && writes ? 2 : 1;
      const auto counter = Get<uint16_t>(bytes, counter_at);
      Put<uint16_t>(
          bytes, counter_at,
          static_cast<uint16_t>(counter + (access.read ? 1 : 0) + (access.written ? both : 0)));
      return;
    }
  }
  const bool positions = datagram.command == Command::kAprd || datagram.command == Command::kApwr ||
                         datagram.command == Command::kAprw || datagram.command == Command::kArmw ||
                         merge || datagram.command == Command::kBwr;
  if (positions) Put<uint16_t>(bytes, 2, static_cast<uint16_t>(adp + 1));

  std::array<uint8_t, kMaxDatagramData> found;
  const std::span<uint8_t> old = std::span(found).first(data.size());
  const bool was_read = read && esc.Read(datagram.ado, old, now);
  const bool was_written = write && esc.Write(datagram.ado, data, now);
  if (was_read) {
    for (size_t i = 0; i < data.size(); ++i) {
      data[i] = static_cast<uint8_t>(merge ? data[i] | old[i] : old[i]);
    }
  }
  const auto counter = Get<uint16_t>(bytes, counter_at);
  Put<uint16_t>(bytes, counter_at,
                static_cast<uint16_t>(counter + (was_read ? 1 : 0) +
                                      (was_written ? (read && write ? 2 : 1) : 0)));
}

}  // namespace poise::ethercat
