#include "components/framework/bus/channel_collector.h"

#include <poll.h>

#include <algorithm>
#include <optional>

#include "components/framework/bus/collected_channel.h"
#include "components/framework/bus/service_link.h"
#include "components/framework/clock.h"
#include "components/framework/run.h"

namespace poise {
namespace {

constexpr int64_t kMillisecond = 1'000'000;
constexpr int64_t kCollectorHealthInterval = 50 * kMillisecond;
constexpr int64_t kFirstServiceRequest = 2 * kMillisecond;
constexpr int64_t kLastServiceRequest = 50 * kMillisecond;
constexpr int64_t kFailing = 1000 * kMillisecond;
constexpr int64_t kGiveUp =
    100 * kMillisecond;     // in real time, on a message that has been asked for
constexpr int kBatch = 64;  // packets of a channel handled before the next channel's turn

struct Lane {
  Lane(const RunSpec& spec, int index)
      : channel(index),
        name(spec.graph().channel(index).name()),
        external(spec.graph().channel(index).external()),
        packets(spec.graph().channel(index), spec.run_id()),
        receiver(ChannelUrl(spec, index), OfRun(spec)) {
    if (TakesStopsOfAll(spec.graph().channel(index))) {
      stops.emplace(ChannelUrl(spec, index), OfOthers(spec));
    }
  }

  int channel;
  std::string name;
  bool external;
  CollectedChannel packets;
  BusReceiver receiver;
  std::optional<BusReceiver> stops;  // of others
  int64_t foreign = 0;
  ChannelCollector::ChannelStatistics statistics;
  int64_t waiting_since = 0;  // ns; of next_tick
  int64_t wait = kFirstServiceRequest;
  int64_t asked_at = 0;  // ns, first time
  bool asked = false;    // for next_tick
};

}  // namespace

class ChannelCollector::Impl {
 public:
  Impl(const RunSpec& spec, const RunSocket& socket, const std::string& name, Callbacks callbacks);
  void Spin(int timeout_ms);
  void Fail(std::string_view reason);

  int64_t recorded_tick() const;
  int64_t final_tick() const { return final_tick_; }
  bool complete() const { return final_tick_ >= 0 && recorded_tick() >= final_tick_; }
  bool stopped() const { return stopped_; }
  const std::vector<std::unique_ptr<Lane>>& lanes() const { return lanes_; }
  const std::vector<Stranger>& strangers() const { return strangers_.strangers(); }

 private:
  void Receive(Lane& lane, int64_t now);
  void ReceiveStops(Lane& lane);
  void Keep(Lane& lane, const BusReceiver::Packet& packet);
  void Deliver(Lane& lane, int64_t now);
  void ReceiveService();
  void Request(int64_t now);
  /// Goes on without what nobody can send any more: in real time a component may skip ticks.
  void GiveUp(Lane& lane, int64_t now, int64_t expected);
  void PublishHealth(int64_t now);

  Callbacks callbacks_;
  ServiceLink service_;
  StrangerWatch strangers_;
  bool realtime_;
  std::vector<std::unique_ptr<Lane>> lanes_;
  std::vector<pollfd> poll_fds_;
  int64_t newest_tick_ = -1;  // seen on any channel
  int64_t final_tick_ = -1;
  int64_t reported_ = -1;
  int64_t next_health_ = 0;
  bool started_ = false;
  bool stopped_ = false;
};

ChannelCollector::Impl::Impl(const RunSpec& spec, const RunSocket& socket, const std::string& name,
                             Callbacks callbacks)
    : callbacks_(std::move(callbacks)),
      service_(spec, socket, {name}),
      strangers_(spec, StrangerWatch::Ports::kProcesses),
      realtime_(spec.realtime()) {
  poll_fds_.push_back({service_.fd(), POLLIN, 0});
  for (int i = 0; i < spec.graph().channel_size(); ++i) {
    lanes_.push_back(std::make_unique<Lane>(spec, i));
    poll_fds_.push_back({lanes_.back()->receiver.fd(), POLLIN, 0});
  }
  for (const auto& lane : lanes_) {
    if (lane->stops) poll_fds_.push_back({lane->stops->fd(), POLLIN, 0});
  }
  service_.health().state = health_t::STATE_READY;
}

int64_t ChannelCollector::Impl::recorded_tick() const {
  int64_t recorded = INT64_MAX;
  for (const auto& lane : lanes_) {
    if (!lane->external) recorded = std::min(recorded, lane->statistics.next_tick - 1);
  }
  return recorded == INT64_MAX ? -1 : recorded;
}

void ChannelCollector::Impl::Spin(int timeout_ms) {
  const int64_t now = NowNanoseconds();
  // Wakes in time to ask, to report and to answer.
  const int64_t due = std::max<int64_t>(0, next_health_ - now) / kMillisecond;
  const int64_t patience =
      newest_tick_ > recorded_tick() || final_tick_ > recorded_tick() ? 2 : due;
  poll(poll_fds_.data(), poll_fds_.size(),
       static_cast<int>(std::min<int64_t>({timeout_ms, due, patience})));
  const int64_t arrival = NowNanoseconds();
  for (size_t i = 0; i < lanes_.size(); ++i) {
    if (poll_fds_[i + 1].revents != 0) Receive(*lanes_[i], arrival);
    if (lanes_[i]->stops) ReceiveStops(*lanes_[i]);
  }
  if (poll_fds_[0].revents != 0) ReceiveService();
  Request(arrival);
  const int64_t recorded = recorded_tick();
  if (recorded >= reported_ + kProgressInterval) {
    reported_ = recorded;
    service_.SendControl(run_control_t::COMMAND_RECORDED, recorded, -1);
  }
  if (arrival >= next_health_) PublishHealth(arrival);
}

void ChannelCollector::Impl::Fail(std::string_view reason) {
  callbacks_ = {};
  callbacks_.message = [](int, int64_t, std::span<const uint8_t>) {};
  service_.SetDetail(reason);
  service_.health().state = health_t::STATE_FAILED;
  const int64_t end = NowNanoseconds() + kFailing;
  for (int64_t now = 0; !stopped_ && now < end; now = NowNanoseconds()) {
    service_.SendHealth();  // again and again: one may be lost
    pollfd service{service_.fd(), POLLIN, 0};
    if (poll(&service, 1, static_cast<int>(kCollectorHealthInterval / kMillisecond)) > 0)
      ReceiveService();
  }
}

void ChannelCollector::Impl::Receive(Lane& lane, int64_t now) {
  BusReceiver::Packet packet;
  for (int i = 0; i < kBatch && lane.receiver.Receive(&packet); ++i) {
    if (packet.channel == lane.name) {
      Keep(lane, packet);
    } else if (packet.channel != "LCM_SELF_TEST") {
      ++lane.foreign;
    }
    if (!lane.external) Deliver(lane, now);
  }
  lane.statistics.duplicates = lane.packets.duplicates();
  lane.statistics.refused =
      lane.packets.counters().refused() + lane.foreign + lane.receiver.malformed();
}

void ChannelCollector::Impl::ReceiveStops(Lane& lane) {
  BusReceiver::Packet packet;
  for (int i = 0; i < kBatch && lane.stops->Receive(&packet); ++i) {
    if (packet.channel == lane.name && OnlyStops(packet)) Keep(lane, packet);
  }
}

void ChannelCollector::Impl::Keep(Lane& lane, const BusReceiver::Packet& packet) {
  const PacketVerdict verdict = lane.packets.Offer(packet.data, packet.size);
  newest_tick_ = std::max(newest_tick_, lane.packets.newest_tick());
  if (!lane.external || verdict != PacketVerdict::kAccepted) return;
  ++lane.statistics.delivered;
  callbacks_.message(lane.channel, lane.packets.tick(packet.data), {packet.data, packet.size});
}

void ChannelCollector::Impl::Deliver(Lane& lane, int64_t now) {
  while (const uint8_t* data = lane.packets.Next()) {
    callbacks_.message(lane.channel, lane.packets.next_tick(), {data, lane.packets.size()});
    lane.packets.Advance();
    ++lane.statistics.delivered;
    lane.waiting_since = now;
    lane.wait = kFirstServiceRequest;
    lane.asked = false;
  }
  lane.statistics.next_tick = lane.packets.next_tick();
}

void ChannelCollector::Impl::Request(int64_t now) {
  const int64_t expected = std::max(newest_tick_, final_tick_);
  for (const auto& lane : lanes_) {
    if (realtime_ && !lane->external) GiveUp(*lane, now, expected);
    if (lane->external || lane->statistics.next_tick > expected) {
      lane->waiting_since = now;
      continue;
    }
    if (now - lane->waiting_since < lane->wait) continue;
    service_.SendControl(run_control_t::COMMAND_RESEND, lane->statistics.next_tick, lane->channel);
    if (!lane->asked) {
      ++lane->statistics.requested;
      lane->asked_at = now;
    }
    lane->asked = true;
    lane->waiting_since = now;
    lane->wait = std::min(2 * lane->wait, kLastServiceRequest);
  }
}

void ChannelCollector::Impl::GiveUp(Lane& lane, int64_t now, int64_t expected) {
  // Ahead of what its window would refuse; and after its writer had time to answer.
  const bool far = expected - lane.packets.next_tick() > kReceiveWindow / 2;
  const bool long_asked = lane.asked && now - lane.asked_at > kGiveUp;
  if (!far && !long_asked) return;
  const int64_t skipped = lane.packets.SkipTo(far ? expected - kReceiveWindow / 4 : expected + 1);
  lane.statistics.skipped += skipped;
  if (skipped > 0 && callbacks_.skipped) {
    callbacks_.skipped(lane.channel, lane.packets.next_tick());
  }
  lane.asked = false;
  lane.wait = kFirstServiceRequest;
  Deliver(lane, now);
}

void ChannelCollector::Impl::ReceiveService() {
  BusReceiver::Packet packet;
  for (int i = 0; i < kBatch && service_.receiver().Receive(&packet); ++i) {
    bool good = false;
    if (packet.channel == kControlChannel) {
      run_control_t control;
      good = service_.filter().DecodeControl(packet, &control);
      if (good && control.command == run_control_t::COMMAND_START) started_ = true;
      if (good && control.command == run_control_t::COMMAND_STOP) stopped_ = true;
    } else {
      health_t health;
      good = service_.filter().DecodeHealth(packet, &health);
      // Its own reports only repeat what it knows.
      if (good && health.component != service_.health().component &&
          health.state >= health_t::STATE_FINISHED && health.tick >= 0) {
        final_tick_ = final_tick_ < 0 ? health.tick : std::min(final_tick_, health.tick);
      }
    }
    if (good && callbacks_.service) callbacks_.service(packet.channel, {packet.data, packet.size});
  }
}

void ChannelCollector::Impl::PublishHealth(int64_t now) {
  next_health_ = now + kCollectorHealthInterval;
  if (strangers_.Look()) service_.SetDetail(Describe(strangers_.strangers()));
  health_t& health = service_.health();
  health.state = complete() ? health_t::STATE_FINISHED
                 : started_ ? health_t::STATE_RUNNING
                            : health_t::STATE_READY;
  health.tick = recorded_tick();
  health.ticks_completed = recorded_tick() + 1;
  health.messages_received = health.messages_duplicate = health.gaps = 0;
  health.messages_refused = service_.refused();
  for (const auto& lane : lanes_) {
    health.messages_received += lane->statistics.delivered;
    health.messages_duplicate += lane->statistics.duplicates;
    health.messages_refused += lane->statistics.refused;
    health.gaps += lane->statistics.requested;
  }
  for (const Stranger& stranger : strangers()) health.messages_refused += stranger.packets;
  service_.SendHealth();
  // Also covers a report that was lost.
  service_.SendControl(run_control_t::COMMAND_RECORDED, recorded_tick(), -1);
}

ChannelCollector::ChannelCollector(const RunSpec& spec, const RunSocket& socket,
                                   const std::string& name, Callbacks callbacks)
    : impl_(std::make_unique<Impl>(spec, socket, name, std::move(callbacks))) {}
ChannelCollector::~ChannelCollector() = default;
void ChannelCollector::Spin(int timeout_ms) { impl_->Spin(timeout_ms); }
void ChannelCollector::Fail(std::string_view reason) { impl_->Fail(reason); }
int64_t ChannelCollector::recorded_tick() const { return impl_->recorded_tick(); }
int64_t ChannelCollector::final_tick() const { return impl_->final_tick(); }
bool ChannelCollector::complete() const { return impl_->complete(); }
bool ChannelCollector::stopped() const { return impl_->stopped(); }

const ChannelCollector::ChannelStatistics& ChannelCollector::statistics(int channel) const {
  return impl_->lanes()[static_cast<size_t>(channel)]->statistics;
}

const std::vector<Stranger>& ChannelCollector::strangers() const { return impl_->strangers(); }

int64_t ChannelCollector::missing(int64_t last_tick) const {
  int64_t missing = 0;
  for (const auto& lane : impl_->lanes()) {
    if (!lane->external)
      missing += lane->statistics.skipped +
                 std::max<int64_t>(0, last_tick + 1 - lane->statistics.next_tick);
  }
  return missing;
}

}  // namespace poise
