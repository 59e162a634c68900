#include "tools/foxglove/foxglove_server.h"

#include <google/protobuf/stubs/strutil.h>

#include <algorithm>
#include <boost/asio/steady_timer.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/foxglove/foxglove_client.h"
#include "tools/run/loopback.h"

namespace poise {
namespace {

namespace asio = boost::asio;
using tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;
using Ordered = nlohmann::ordered_json;

constexpr size_t kMaxConnections = 16;
constexpr std::chrono::milliseconds kAcceptPause{100};  // when the system has no more sockets

// Foxglove's web application. Its desktop program is a page of a file, or has no origin.
constexpr std::string_view kFoxglove[] = {"https://app.foxglove.dev", "https://studio.foxglove.dev",
                                          "file://"};

/// A page of a server on this machine, on any port.
bool IsLocal(std::string_view origin) {
  for (const std::string_view here : {"http://127.0.0.1", "http://localhost"}) {
    if (origin == here || (origin.starts_with(here) && origin[here.size()] == ':')) return true;
  }
  return false;
}

std::string Advertisement(const std::vector<SceneTopic>& topics) {
  Ordered channels = Ordered::array();
  for (size_t i = 0; i < topics.size(); ++i) {
    const SceneTopic& topic = topics[i];
    std::string schema = topic.schema_data;
    if (topic.schema_encoding == "protobuf") {  // bytes, which JSON has not
      schema.clear();
      google::protobuf::Base64Escape(topic.schema_data, &schema);
    }
    channels.push_back({{"id", i + 1},
                        {"topic", topic.name},
                        {"encoding", topic.encoding},
                        {"schemaName", topic.schema},
                        {"schemaEncoding", topic.schema_encoding},
                        {"schema", std::move(schema)}});
  }
  return Ordered({{"op", "advertise"}, {"channels", std::move(channels)}}).dump();
}

}  // namespace

class FoxgloveServer::Impl : public FoxgloveHost {
 public:
  Impl(int port, const std::string& name, const std::vector<SceneTopic>& topics,
       std::vector<std::string> origins)
      : origins_(std::move(origins)),
        info_(Ordered({{"op", "serverInfo"}, {"name", name}, {"capabilities", {"time"}}})
                  .dump(-1, ' ', false, Ordered::error_handler_t::replace)),
        advertisement_(std::make_shared<const std::string>(Advertisement(topics))),
        kept_(topics.size()) {
    for (const SceneTopic& topic : topics) {
      keeps_.push_back(topic.kept);
      precedes_.push_back(topic.name.starts_with('/'));
    }
    port_ = ListenHere(port, "--foxglove", "choose another", &acceptor_);
    Accept();
  }
  ~Impl() override {
    for (const auto& client : clients_) client->Close();
  }

  int port() const override { return port_; }
  bool IsOriginAllowed(std::string_view origin) const override {
    return IsLocal(origin) || std::ranges::find(kFoxglove, origin) != std::end(kFoxglove) ||
           std::ranges::find(origins_, origin) != origins_.end();
  }
  size_t num_channels() const override { return keeps_.size(); }
  const std::string& server_info() const override { return info_; }
  std::shared_ptr<const std::string> advertisement() const override { return advertisement_; }
  bool HasPrecedence(size_t channel) const override { return precedes_[channel]; }
  const Kept* KeptOf(size_t channel) const override {
    return kept_[channel].message ? &kept_[channel] : nullptr;
  }

  void Poll() {
    io_.restart();
    io_.poll();
    for (const auto& client : clients_) client->Check();
    ForgetClosed();
  }
  bool Wants(size_t topic) const {
    return keeps_[topic] ||
           std::ranges::any_of(clients_, [&](const auto& client) { return client->wants(topic); });
  }
  void Send(size_t topic, uint64_t time, std::string message) {
    if (!Wants(topic)) return;
    const auto shared = std::make_shared<const std::string>(std::move(message));
    if (keeps_[topic]) kept_[topic] = {time, shared};
    for (const auto& client : clients_) client->Send(topic, time, shared);
  }
  void SendTime(uint64_t time) {
    for (const auto& client : clients_) client->SendTime(time);
  }
  int64_t dropped() const {
    int64_t sum = dropped_;
    for (const auto& client : clients_) sum += client->dropped();
    return sum;
  }
  size_t clients() const { return clients_.size(); }

 private:
  void ForgetClosed() {
    std::erase_if(clients_, [this](const std::shared_ptr<FoxgloveClient>& client) {
      if (client->closed()) dropped_ += client->dropped();
      return client->closed();
    });
  }
  void Accept() {
    acceptor_.async_accept([this](ErrorCode error, tcp::socket socket) {
      if (error) {
        accept_timer_.expires_after(kAcceptPause);
        accept_timer_.async_wait([this](ErrorCode) { Accept(); });
        return;
      }
      ForgetClosed();                           // of this poll: they leave room
      if (clients_.size() < kMaxConnections) {  // else the socket closes
        clients_.push_back(std::make_shared<FoxgloveClient>(std::move(socket), this));
        clients_.back()->Start();
      }
      Accept();
    });
  }

  asio::io_context io_{1};
  tcp::acceptor acceptor_{io_};
  asio::steady_timer accept_timer_{io_};
  int port_ = 0;
  const std::vector<std::string> origins_;
  const std::string info_;
  const std::shared_ptr<const std::string> advertisement_;
  std::vector<bool> keeps_;     // by topic
  std::vector<bool> precedes_;  // likewise: the scene's, few and small beside the bus's
  std::vector<Kept> kept_;      // likewise
  std::vector<std::shared_ptr<FoxgloveClient>> clients_;
  int64_t dropped_ = 0;  // of clients that are gone
};

FoxgloveServer::FoxgloveServer(int port, const std::string& name,
                               const std::vector<SceneTopic>& topics,
                               std::vector<std::string> origins)
    : impl_(std::make_unique<Impl>(port, name, topics, std::move(origins))) {}
FoxgloveServer::~FoxgloveServer() = default;
int FoxgloveServer::port() const { return impl_->port(); }
void FoxgloveServer::Poll() { impl_->Poll(); }
bool FoxgloveServer::Wants(size_t topic) const { return impl_->Wants(topic); }
void FoxgloveServer::Send(size_t topic, uint64_t time, std::string message) {
  impl_->Send(topic, time, std::move(message));
}
void FoxgloveServer::SendTime(uint64_t time) { impl_->SendTime(time); }
int64_t FoxgloveServer::dropped() const { return impl_->dropped(); }
size_t FoxgloveServer::clients() const { return impl_->clients(); }

}  // namespace poise
