#include "tools/live/view_server.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include "fmt/format.h"
#include "tools/live/view_access.h"
#include "tools/run/local_server.h"

namespace poise {
namespace {

constexpr size_t kMaxConnections = 32;
constexpr size_t kMaxStreams = 16;             // the other places are for those who come
constexpr size_t kMaxReceived = 1 << 10;       // bytes a WebSocket message; acts have about 200
constexpr double kActRate = 60;                // texts/s of a client; a dragged robot's are 30
constexpr double kActBurst = 60;               // texts at once
constexpr size_t kMaxBatch = size_t{1} << 20;  // bytes
constexpr int64_t kMostBatches = 4;  // batches: then what a client lacks waits until it asks

using Text = std::shared_ptr<const std::string>;
/// What every client is told, in this order and before any tick.
enum TextKind : size_t { kState, kStatus, kControl, kTexts };

/// s, of a clock that goes on evenly.
double Seconds() {
  return std::chrono::duration<double>(LocalClient::Clock::now().time_since_epoch()).count();
}

}  // namespace

class ViewServer::Impl : public LocalServer {
 public:
  Impl(int port, std::string page, const TickRing* ring, ViewControl control)
      : LocalServer(port, "--port", "choose another, or leave it out", kMaxConnections),
        page_(std::make_shared<const std::string>(std::move(page))),
        ring_(ring),
        control_(std::move(control)) {}

  std::string url() const {
    return fmt::format("http://127.0.0.1:{}/{}{}", port(),
                       control_.token.empty() ? "" : "?token=", control_.token);
  }
  int64_t dropped() const { return dropped_; }
  void SendTicks();
  void Tell(size_t what, std::string json) {
    if (!texts_[what] || *texts_[what] != json) {
      texts_[what] = std::make_shared<const std::string>(std::move(json));
    }
  }
  void Restart();
  std::string WhyForeign(std::string_view origin) const override {
    return IsOriginHere(origin, port()) ? ""
                                        : fmt::format("only for http://127.0.0.1:{}/\n", port());
  }

 private:
  class Client;

  std::shared_ptr<LocalClient> MakeClient(boost::asio::ip::tcp::socket socket) override;
  size_t streams() const;
  Text Batch(int64_t from, int64_t to);

  const Text page_;
  const TickRing* ring_;
  const ViewControl control_;
  std::array<Text, kTexts> texts_;
  // The batch made last: clients that keep up want the same.
  Text batch_;
  int64_t batch_from_ = -1;
  int64_t batch_to_ = -1;
  int64_t dropped_ = 0;
};

/// A page, its earlier ticks, or the stream of them.
class ViewServer::Impl::Client : public LocalClient {
 public:
  Client(boost::asio::ip::tcp::socket socket, Impl* server)
      : LocalClient(std::move(socket), server, kMaxReceived), server_(server) {}

  void SendTicks() {
    if (stuck()) {
      ++server_->dropped_;
      Close();
    } else {
      Send();
    }
  }
  void Restart() { next_ = 0; }

 private:
  void Answer(const Request& request) override {
    const std::optional<ViewTarget> target =
        ReadTarget({request.target().data(), request.target().size()});
    const std::string& token = server_->control_.token;
    const bool get = request.method() == boost::beast::http::verb::get ||
                     request.method() == boost::beast::http::verb::head;
    if (!token.empty() && (!target || !SameToken(target->token, token))) {
      Refuse(Status::forbidden, "the address that poise printed has a token\n");
    } else if (boost::beast::websocket::is_upgrade(request)) {
      if (!target || target->path != "/stream") {
        Refuse(Status::not_found, "the stream is /stream or /stream?from=TICK\n");
      } else if (server_->streams() >= kMaxStreams) {
        Refuse(Status::service_unavailable, "too many pages are open\n");
      } else {
        next_ = target->from;
        Upgrade();
      }
    } else if (!get) {
      Refuse(Status::method_not_allowed, "only GET\n");
    } else if (target && target->path == "/") {
      Respond(Status::ok, server_->page_, "text/html; charset=utf-8");
    } else if (target && target->path == "/ticks") {
      Respond(Status::ok, std::make_shared<const std::string>(Earlier(target->before)),
              "application/octet-stream");
    } else {
      Refuse(Status::not_found, "there is / and /ticks?before=TICK\n");
    }
  }

  /// The last batch of the ticks before `tick` that are still held; of no tick where there is none.
  std::string Earlier(int64_t tick) const {
    const TickRing& ring = *server_->ring_;
    const int64_t to = std::clamp(tick, ring.first_tick(), ring.end_tick());
    return ring.Encode(std::max(ring.first_tick(), to - BatchTicks()), to, Seconds());
  }

  void Opened() override { Send(); }

  /// Acts: none of our pages sends another message, and one that only looks sends none at all.
  bool Take(std::string_view message, bool text) override {
    const ViewControl& control = server_->control_;
    if (control.token.empty() || !text) return false;
    const auto now = Clock::now();
    const double passed = std::chrono::duration<double>(now - refilled_).count();
    allowance_ = std::min(kActBurst, allowance_ + kActRate * passed);
    refilled_ = now;
    if (allowance_ < 1) return false;
    --allowance_;
    return control.receive(message);
  }

  void Send() {
    if (writing() || !streaming()) return;
    const TickRing& ring = *server_->ring_;
    for (size_t what = 0; what < kTexts; ++what) {
      if (sent_[what] == server_->texts_[what]) continue;
      sent_[what] = server_->texts_[what];
      sends_text_ = true;
      return Write("", sent_[what], true);
    }
    if (next_ >= ring.end_tick()) return;
    next_ = std::max(next_, ring.first_tick());
    // What is new goes first.
    if (ring.end_tick() - next_ > kMostBatches * BatchTicks()) {
      next_ = ring.end_tick() - BatchTicks();
    }
    const int64_t from = std::exchange(next_, std::min(ring.end_tick(), next_ + BatchTicks()));
    sends_text_ = false;
    Write("", server_->Batch(from, next_), false);
  }

  /// Goes on when it is behind by a whole batch, or by what a text has kept waiting: then it does
  /// not wait for the next picture, which may begin with a text again.
  void Written() override {
    const int64_t ticks = server_->ring_->end_tick() - next_;  // negative: asked for later ones
    if (sent_ != server_->texts_ || ticks >= (sends_text_ ? 1 : BatchTicks())) Send();
  }
  int64_t BatchTicks() const {
    return static_cast<int64_t>(std::max<size_t>(1, kMaxBatch / server_->ring_->tick_size()));
  }

  Impl* const server_;
  bool sends_text_ = false;  // or sent last
  int64_t next_ = 0;         // tick
  std::array<Text, kTexts> sent_;
  double allowance_ = kActBurst;  // texts
  Clock::time_point refilled_ = came();
};

std::shared_ptr<LocalClient> ViewServer::Impl::MakeClient(boost::asio::ip::tcp::socket socket) {
  return std::make_shared<Client>(std::move(socket), this);
}

size_t ViewServer::Impl::streams() const {
  return static_cast<size_t>(
      std::ranges::count_if(clients(), [](const auto& c) { return c->streaming(); }));
}

void ViewServer::Impl::SendTicks() {
  const auto all = clients();  // one may end meanwhile
  for (const auto& client : all) static_cast<Client&>(*client).SendTicks();
}

void ViewServer::Impl::Restart() {
  batch_from_ = batch_to_ = -1;
  for (const auto& client : clients()) static_cast<Client&>(*client).Restart();
}

Text ViewServer::Impl::Batch(int64_t from, int64_t to) {
  if (from != batch_from_ || to != batch_to_) {
    batch_ = std::make_shared<const std::string>(ring_->Encode(from, to, Seconds()));
    batch_from_ = from;
    batch_to_ = to;
  }
  return batch_;
}

ViewServer::ViewServer(int port, std::string page, const TickRing* ring, ViewControl control)
    : impl_(std::make_unique<Impl>(port, std::move(page), ring, std::move(control))) {}
ViewServer::~ViewServer() = default;
int ViewServer::port() const { return impl_->port(); }
std::string ViewServer::url() const { return impl_->url(); }
void ViewServer::Restart() { impl_->Restart(); }
void ViewServer::RunFor(std::chrono::milliseconds duration) { impl_->RunFor(duration); }
int64_t ViewServer::dropped() const { return impl_->dropped(); }
void ViewServer::SendTicks() { impl_->SendTicks(); }
void ViewServer::SetState(std::string json) { impl_->Tell(kState, std::move(json)); }
void ViewServer::SetStatus(std::string json) { impl_->Tell(kStatus, std::move(json)); }
void ViewServer::SetControl(std::string json) { impl_->Tell(kControl, std::move(json)); }

}  // namespace poise
