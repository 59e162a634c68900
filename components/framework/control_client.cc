#include "components/framework/control_client.h"

#include <poll.h>

#include <algorithm>

#include "components/framework/clock.h"
#include "components/framework/run.h"
#include "components/framework/udp_bus.h"
#include "poise/message_traits.hpp"

namespace poise {

struct ControlClient::Links {
  explicit Links(const RunSpec& spec) : sender(ServiceUrl(spec)), receiver(ServiceUrl(spec)) {}
  BusSender sender;
  BusReceiver receiver;

  bool Send(int64_t run_id, int8_t command) {
    run_control_t control{};
    control.run_id = run_id;
    control.command = command;
    control.channel = -1;
    std::vector<uint8_t> bytes(static_cast<size_t>(control.getEncodedSize()));
    control.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    return sender.Send(kControlChannel, bytes.data(), bytes.size());
  }
};

ControlClient::ControlClient(const RunSpec& spec, const std::vector<std::string>& others)
    : run_id_(spec.run_id()), links_(std::make_unique<Links>(spec)) {
  std::vector<std::string> names = others;
  for (const ComponentInstance& instance : spec.graph().component())
    names.push_back(instance.name());
  for (const std::string& name : names) {
    statuses_[name];
    name_of_channel_[HealthChannel(name)] = name;
  }
}

ControlClient::~ControlClient() = default;

bool ControlClient::SendStart() { return links_->Send(run_id_, run_control_t::COMMAND_START); }
bool ControlClient::SendStop() { return links_->Send(run_id_, run_control_t::COMMAND_STOP); }

void ControlClient::Spin(int timeout_ms) {
  pollfd fd{links_->receiver.fd(), POLLIN, 0};
  if (poll(&fd, 1, timeout_ms) <= 0) return;
  BusReceiver::Packet packet;
  while (links_->receiver.Receive(&packet)) {
    const auto channel = name_of_channel_.find(packet.channel);
    if (channel == name_of_channel_.end()) continue;
    health_t health;
    if (!DecodeChecked(packet.data, static_cast<int64_t>(packet.size), &health) ||
        health.run_id != run_id_ || health.component != channel->second) {
      ++refused_;
      continue;
    }
    Status& status = statuses_[channel->second];
    status.seen = true;
    status.last_seen = NowNanoseconds();
    status.health = std::move(health);
  }
}

bool ControlClient::AllReached(int8_t state) const {
  return std::all_of(statuses_.begin(), statuses_.end(), [&](const auto& entry) {
    return entry.second.seen && entry.second.health.state >= state;
  });
}

}  // namespace poise
