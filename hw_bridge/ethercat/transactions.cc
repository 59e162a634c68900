#include "hw_bridge/ethercat/transactions.h"

#include <algorithm>

namespace poise::ethercat {

std::optional<uint16_t> Transactions::Execute(Command command, uint16_t adp, uint16_t ado,
                                              std::span<uint8_t> data,
                                              std::optional<int> attempts) {
  for (int attempt = 0; attempt < attempts.value_or(attempts_); ++attempt) {
    builder_.Clear();
    const Datagram sent{
        .command = command, .index = NextIndex(), .adp = adp, .ado = ado, .data = data};
    if (!builder_.Add(command, sent.index, adp, ado, data)) return std::nullopt;
    if (!link_->Send(builder_.bytes())) {
      // A link that is down for a moment is given the time of a lost frame.
      static_cast<void>(link_->Receive(received_, link_->Now() + timeout_));
      continue;
    }
    ++counts_.sent;
    uint16_t working_counter = 0;
    if (Await(sent, data, &working_counter)) return working_counter;
    ++counts_.lost;
  }
  return std::nullopt;
}

bool Transactions::Await(const Datagram& sent, std::span<uint8_t> data, uint16_t* working_counter) {
  const int64_t deadline = link_->Now() + timeout_;
  while (const size_t size = link_->Receive(received_, deadline)) {
    FrameReader reader{std::span(received_).first(size)};
    if (!reader.valid()) {
      ++counts_.refused;
      continue;
    }
    const Datagram back = *reader.Next();
    // Slaves change the address field of auto-increment and broadcast commands, never ADO.
    if (reader.num_datagrams() != 1 || back.index != sent.index || back.command != sent.command ||
        back.ado != sent.ado || back.data.size() != data.size()) {
      ++counts_.unexpected;
      continue;
    }
    std::copy(back.data.begin(), back.data.end(), data.begin());
    *working_counter = back.working_counter;
    ++counts_.returned;
    return true;
  }
  return false;
}

}  // namespace poise::ethercat
