#include "tools/foxglove/foxglove_server.h"

#include <algorithm>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/run/local_server.h"

namespace poise {
namespace {

using Json = nlohmann::json;
using Ordered = nlohmann::ordered_json;
using Text = std::shared_ptr<const std::string>;

constexpr size_t kMaxConnections = 16;
constexpr const char* kProtocol = "foxglove.websocket.v1";
constexpr size_t kMaxReceived = 64 << 10;  // bytes a message: some thousand subscriptions
constexpr size_t kMaxQueue = 512;          // messages
constexpr size_t kMaxQueuedBytes = size_t{8} << 20;
constexpr std::chrono::seconds kTellAgain{1};
constexpr uint8_t kMessageData = 1, kTime = 2;  // binary opcodes
constexpr int kWarning = 1, kError = 2;         // levels of a status

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

template <class Integer>
void AddLittleEndian(Integer value, std::string* bytes) {
  for (size_t i = 0; i < sizeof(Integer); ++i) {
    bytes->push_back(static_cast<char>(static_cast<uint64_t>(value) >> (8 * i)));
  }
}

/// Whether a list as of Sec-WebSocket-Protocol has `protocol`.
bool Lists(std::string_view list, std::string_view protocol) {
  for (const auto& token : boost::beast::http::token_list({list.data(), list.size()})) {
    if (std::string_view(token.data(), token.size()) == protocol) return true;
  }
  return false;
}

/// A whole number of a JSON object, if it is one from 0 to `most`.
std::optional<size_t> NumberOf(const Json& object, const char* name, size_t most) {
  if (!object.is_object()) return {};
  const auto found = object.find(name);
  if (found == object.end() || !found->is_number_unsigned()) return {};
  const auto number = found->get<uint64_t>();
  if (number > most) return {};
  return number;
}

std::string Advertisement(const std::vector<SceneTopic>& topics) {
  Ordered channels = Ordered::array();
  for (size_t i = 0; i < topics.size(); ++i) {
    const SceneTopic& topic = topics[i];
    const bool bytes = topic.schema_encoding == "protobuf";  // which JSON has not
    channels.push_back({{"id", i + 1},
                        {"topic", topic.name},
                        {"encoding", topic.encoding},
                        {"schemaName", topic.schema},
                        {"schemaEncoding", topic.schema_encoding},
                        {"schema", bytes ? logging::Base64(topic.schema_data) : topic.schema_data}});
  }
  return Ordered({{"op", "advertise"}, {"channels", std::move(channels)}}).dump();
}

}  // namespace

class FoxgloveServer::Impl : public LocalServer {
 public:
  Impl(int port, const std::string& name, const std::vector<SceneTopic>& topics,
       std::vector<std::string> origins)
      : LocalServer(port, "--foxglove", "choose another", kMaxConnections),
        origins_(std::move(origins)),
        info_(Ordered({{"op", "serverInfo"}, {"name", name}, {"capabilities", {"time"}}})
                  .dump(-1, ' ', false, Ordered::error_handler_t::replace)),
        advertisement_(std::make_shared<const std::string>(Advertisement(topics))),
        kept_(topics.size()) {
    for (const SceneTopic& topic : topics) {
      keeps_.push_back(topic.kept);
      precedes_.push_back(topic.name.starts_with('/'));
    }
  }

  std::string WhyForeign(std::string_view origin) const override {
    const bool allowed = IsLocal(origin) ||
                         std::ranges::find(kFoxglove, origin) != std::end(kFoxglove) ||
                         std::ranges::find(origins_, origin) != origins_.end();
    return allowed ? "" : "not for pages of this origin; poise view --foxglove-origin allows one\n";
  }
  void Check();
  bool Wants(size_t topic) const;
  void Send(size_t topic, uint64_t time, std::string message);
  void SendTime(uint64_t time);
  int64_t dropped() const { return dropped_; }

 private:
  class Client;
  struct Kept {
    uint64_t time = 0;  // ns
    Text message;       // null: none yet
  };

  std::shared_ptr<LocalClient> MakeClient(boost::asio::ip::tcp::socket socket) override;

  const std::vector<std::string> origins_;
  const std::string info_;
  const Text advertisement_;
  std::vector<bool> keeps_;     // by topic: later subscribers get its last message as well
  std::vector<bool> precedes_;  // by topic: the scene's, few and small beside the bus's
  std::vector<Kept> kept_;      // by topic
  int64_t dropped_ = 0;
};

/// A connection, which must become the protocol's WebSocket. What waits to be sent is bounded:
/// beyond it messages are dropped, counted, and the client is told; topics without precedence fill
/// half of it at most. Who takes nothing for 5 s is dropped itself. Reading pauses while answers
/// wait.
class FoxgloveServer::Impl::Client : public LocalClient {
 public:
  Client(boost::asio::ip::tcp::socket socket, Impl* server)
      : LocalClient(std::move(socket), server, kMaxReceived), server_(server) {}

  /// A message of a topic, if the client has subscribed to it.
  void Send(size_t topic, uint64_t time, const Text& message) {
    const auto subscribed = subscription_of_.find(topic);
    if (!streaming() || subscribed == subscription_of_.end()) return;
    if (IsFull(server_->precedes_[topic] ? 1 : 2)) {
      ++dropped_;
      ++server_->dropped_;
      return;
    }
    QueueMessage(subscribed->second, time, message);
  }
  /// The time op: ns.
  void SendTime(uint64_t time) {
    if (!streaming() || queue_.size() >= kMaxQueue) return;
    Outgoing outgoing{"", nullptr, true};
    AddLittleEndian(kTime, &outgoing.head);
    AddLittleEndian(time, &outgoing.head);
    Queue(std::move(outgoing));
  }
  /// Tells what was dropped, and ends a connection that takes nothing.
  void Check() {
    const auto now = Clock::now();
    if (stuck()) {
      Close();
    } else if (dropped_ > 0 && now > told_ + kTellAgain && queue_.size() < kMaxQueue) {
      Tell(kWarning, fmt::format("{} messages were dropped: they are not taken fast enough",
                                 std::exchange(dropped_, 0)));
      told_ = now;
    }
  }
  bool wants(size_t topic) const { return streaming() && subscription_of_.contains(topic); }

 private:
  struct Outgoing {
    std::string head;  // of the frame: all of a text
    Text message;
    bool binary = false;
    size_t size() const { return head.size() + (message ? message->size() : 0); }
  };

  void Answer(const Request& request) override {
    const auto protocols = request[boost::beast::http::field::sec_websocket_protocol];
    if (!boost::beast::websocket::is_upgrade(request)) {
      Refuse(Status::upgrade_required,
             fmt::format("open ws://127.0.0.1:{} in Foxglove: \"Open connection\"\n",
                         server_->port()));
    } else if (!Lists({protocols.data(), protocols.size()}, kProtocol)) {
      Refuse(Status::bad_request, fmt::format("the subprotocol must be {}\n", kProtocol));
    } else {
      Upgrade(kProtocol);
    }
  }
  void Opened() override {
    Queue({server_->info_, nullptr, false});
    Queue({"", server_->advertisement_, false});
  }
  /// A client that asks for more than it takes waits.
  bool Reads() const override { return !IsFull(1); }
  void Written() override {
    queued_bytes_ -= on_its_way_;
    if (!queue_.empty()) WriteNext();
    if (!IsFull(2)) Receive();
  }

  bool IsFull(size_t share) const {
    return queue_.size() >= kMaxQueue / share || queued_bytes_ >= kMaxQueuedBytes / share;
  }
  bool Take(std::string_view text, bool is_text) override;
  void Subscribe(size_t subscription, size_t channel);
  void Tell(int level, std::string_view text) {
    Queue({Json({{"op", "status"}, {"level", level}, {"message", text}}).dump(), nullptr, false});
  }
  void QueueMessage(uint32_t subscription, uint64_t time, const Text& message) {
    Outgoing outgoing{"", message, true};
    AddLittleEndian(kMessageData, &outgoing.head);
    AddLittleEndian(subscription, &outgoing.head);
    AddLittleEndian(time, &outgoing.head);
    Queue(std::move(outgoing));
  }
  void Queue(Outgoing outgoing) {
    if (closed()) return;
    queued_bytes_ += outgoing.size();
    queue_.push_back(std::move(outgoing));
    if (!writing()) WriteNext();
  }
  void WriteNext() {
    Outgoing outgoing = std::move(queue_.front());
    queue_.pop_front();
    on_its_way_ = outgoing.size();
    Write(std::move(outgoing.head), std::move(outgoing.message), !outgoing.binary);
  }

  Impl* const server_;
  std::deque<Outgoing> queue_;
  size_t queued_bytes_ = 0, on_its_way_ = 0;  // the latter among the former
  int64_t dropped_ = 0;                       // that the client has not been told of
  Clock::time_point told_;
  std::map<uint32_t, size_t> topic_of_;         // by subscription
  std::map<size_t, uint32_t> subscription_of_;  // by topic, which has one at most
};

bool FoxgloveServer::Impl::Client::Take(std::string_view text, bool is_text) {
  const auto fail = [&](std::string_view why) {
    Tell(kError, why);
    return true;  // it goes on
  };
  if (!is_text) return fail("clients publish nothing here");
  const Json message = Json::parse(text, nullptr, false);
  if (!message.is_object() || !message.contains("op") || !message["op"].is_string()) {
    return fail("a message must be a JSON object with an op");
  }
  const std::string& op = message["op"].get_ref<const std::string&>();
  const bool subscribe = op == "subscribe";
  if (!subscribe && op != "unsubscribe") {
    return fail("there are the ops subscribe and unsubscribe alone");
  }
  const char* const name = subscribe ? "subscriptions" : "subscriptionIds";
  const auto list = message.find(name);
  if (list == message.end() || !list->is_array()) {
    return fail(fmt::format("{}: {} must be an array", op, name));
  }
  for (const Json& item : *list) {
    if (subscribe) {
      const std::optional<size_t> id = NumberOf(item, "id", UINT32_MAX);
      const std::optional<size_t> channel = NumberOf(item, "channelId", UINT32_MAX);
      if (!id || !channel) return fail("subscribe: id and channelId must be whole numbers");
      Subscribe(*id, *channel);
    } else if (item.is_number_unsigned() && item.get<uint64_t>() <= UINT32_MAX) {
      const auto known = topic_of_.find(item.get<uint32_t>());
      if (known == topic_of_.end()) continue;
      subscription_of_.erase(known->second);
      topic_of_.erase(known);
    }
  }
  return true;
}

void FoxgloveServer::Impl::Client::Subscribe(size_t subscription, size_t channel) {
  // Channels count from 1.
  if (channel < 1 || channel > server_->keeps_.size()) {
    return Tell(kError, fmt::format("subscribe: there is no channel {}", channel));
  }
  const size_t topic = channel - 1;
  const auto id = static_cast<uint32_t>(subscription);
  if (topic_of_.contains(id) || subscription_of_.contains(topic)) {
    return Tell(kError,
                fmt::format("subscribe: channel {} or id {} has a subscription", channel, id));
  }
  topic_of_[id] = topic;
  subscription_of_[topic] = id;
  const Kept& kept = server_->kept_[topic];
  if (kept.message) QueueMessage(id, kept.time, kept.message);  // never dropped
}

std::shared_ptr<LocalClient> FoxgloveServer::Impl::MakeClient(boost::asio::ip::tcp::socket socket) {
  return std::make_shared<Client>(std::move(socket), this);
}

void FoxgloveServer::Impl::Check() {
  const auto all = clients();  // one may end meanwhile
  for (const auto& client : all) static_cast<Client&>(*client).Check();
}

bool FoxgloveServer::Impl::Wants(size_t topic) const {
  return keeps_[topic] || std::ranges::any_of(clients(), [&](const auto& client) {
           return static_cast<const Client&>(*client).wants(topic);
         });
}

void FoxgloveServer::Impl::Send(size_t topic, uint64_t time, std::string message) {
  if (!Wants(topic)) return;
  const auto shared = std::make_shared<const std::string>(std::move(message));
  if (keeps_[topic]) kept_[topic] = {time, shared};
  for (const auto& client : clients()) static_cast<Client&>(*client).Send(topic, time, shared);
}

void FoxgloveServer::Impl::SendTime(uint64_t time) {
  for (const auto& client : clients()) static_cast<Client&>(*client).SendTime(time);
}

FoxgloveServer::FoxgloveServer(int port, const std::string& name,
                               const std::vector<SceneTopic>& topics,
                               std::vector<std::string> origins)
    : impl_(std::make_unique<Impl>(port, name, topics, std::move(origins))) {}
FoxgloveServer::~FoxgloveServer() = default;
int FoxgloveServer::port() const { return impl_->port(); }
void FoxgloveServer::Poll() {
  impl_->Poll();
  impl_->Check();
}
bool FoxgloveServer::Wants(size_t topic) const { return impl_->Wants(topic); }
void FoxgloveServer::Send(size_t topic, uint64_t time, std::string message) {
  impl_->Send(topic, time, std::move(message));
}
void FoxgloveServer::SendTime(uint64_t time) { impl_->SendTime(time); }
int64_t FoxgloveServer::dropped() const { return impl_->dropped(); }

}  // namespace poise
