#include "components/framework/bus/control_client.h"

#include <poll.h>

#include <algorithm>
#include <optional>

#include "components/framework/bus/service_filter.h"
#include "components/framework/clock.h"
#include "components/framework/run.h"

namespace poise {

struct ControlClient::Links {
  Links(const RunSpec& spec, const RunSocket* socket, const std::vector<std::string>& others)
      : receiver(ServiceUrl(spec), OfRun(spec)), filter(spec, others) {
    if (socket != nullptr) sender.emplace(*socket, ServiceUrl(spec));
  }
  std::optional<RunSender> sender;
  BusReceiver receiver;
  ServiceFilter filter;

  bool Send(int64_t run_id, int8_t command) {
    run_control_t control{};
    control.run_id = run_id;
    control.command = command;
    control.channel = -1;
    const std::vector<uint8_t> bytes = MessageBytes(control);
    return sender && sender->Send(kControlChannel, bytes.data(), bytes.size());
  }
};

ControlClient::ControlClient(const RunSpec& spec, const RunSocket* socket,
                             const std::vector<std::string>& others)
    : run_id_(spec.run_id()), links_(std::make_unique<Links>(spec, socket, others)) {
  for (const std::string& name : others) statuses_[name];
  for (const ComponentInstance& instance : spec.graph().component()) statuses_[instance.name()];
}

ControlClient::~ControlClient() = default;

bool ControlClient::SendStart() { return links_->Send(run_id_, run_control_t::COMMAND_START); }
bool ControlClient::SendStop() { return links_->Send(run_id_, run_control_t::COMMAND_STOP); }

void ControlClient::Spin(int timeout_ms, std::span<const int> wake_fds) {
  std::vector<pollfd> fds = {{links_->receiver.fd(), POLLIN, 0}};
  for (const int fd : wake_fds) fds.push_back({fd, POLLIN, 0});
  if (poll(fds.data(), fds.size(), timeout_ms) <= 0) return;
  BusReceiver::Packet packet;
  while (links_->receiver.Receive(&packet)) {
    if (packet.channel == kControlChannel) {
      run_control_t control;
      links_->filter.DecodeControl(packet, &control);  // only counts what is wrong
      continue;
    }
    health_t health;
    if (!links_->filter.DecodeHealth(packet, &health)) continue;
    const auto watched = statuses_.find(health.component);
    if (watched == statuses_.end()) continue;
    Status& status = watched->second;
    status.seen = true;
    status.last_seen = NowNanoseconds();
    status.health = std::move(health);
  }
}

int64_t ControlClient::refused() const {
  return links_->filter.refused() + links_->receiver.malformed();
}

bool ControlClient::AllReached(int8_t state) const {
  return std::all_of(statuses_.begin(), statuses_.end(), [&](const auto& entry) {
    return entry.second.seen && entry.second.health.state >= state;
  });
}

}  // namespace poise
