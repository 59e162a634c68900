#include "tools/foxglove/foxglove_client.h"

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "fmt/format.h"
#include "tools/run/loopback.h"

namespace poise {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Clock = std::chrono::steady_clock;
using ErrorCode = boost::system::error_code;
using Json = nlohmann::json;

constexpr const char* kProtocol = "foxglove.websocket.v1";
constexpr uint32_t kMaxHeader = 16 << 10;  // bytes; browsers send about 1 KB
constexpr size_t kMaxReceived = 64 << 10;  // bytes a message: some thousand subscriptions
constexpr size_t kMaxQueue = 512;          // messages
constexpr size_t kMaxQueuedBytes = size_t{8} << 20;
constexpr int kSendBuffer = 256 << 10;  // bytes, in the system
constexpr std::chrono::seconds kPatience{5};
constexpr std::chrono::seconds kTellAgain{1};
constexpr uint8_t kMessageData = 1, kTime = 2;  // binary opcodes
constexpr int kWarning = 1, kError = 2;         // levels of a status

std::string_view View(beast::string_view text) { return {text.data(), text.size()}; }

template <class Integer>
void AddLittleEndian(Integer value, std::string* bytes) {
  for (size_t i = 0; i < sizeof(Integer); ++i) {
    bytes->push_back(static_cast<char>(static_cast<uint64_t>(value) >> (8 * i)));
  }
}

/// Whether a list as of Sec-WebSocket-Protocol has `protocol`.
bool Lists(std::string_view list, std::string_view protocol) {
  for (const auto& token : http::token_list({list.data(), list.size()})) {
    if (View(token) == protocol) return true;
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

}  // namespace

FoxgloveClient::FoxgloveClient(asio::ip::tcp::socket socket, FoxgloveHost* host)
    : stream_(std::move(socket)), host_(host), buffer_(kMaxHeader + kMaxReceived) {}

void FoxgloveClient::Start() {
  ErrorCode ignored;  // the default size does as well
  Socket().socket().set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
  parser_.header_limit(kMaxHeader);
  Socket().expires_after(kPatience);
  http::async_read(Socket(), buffer_, parser_,
                   [self = shared_from_this()](ErrorCode error, size_t) {
                     if (error) {
                       self->Close();
                     } else {
                       self->Answer();
                     }
                   });
}

void FoxgloveClient::Close() {
  if (closed_) return;
  closed_ = true;
  streaming_ = false;
  ErrorCode ignored;
  Socket().socket().close(ignored);
  queue_.clear();
  queued_bytes_ = 0;
  channel_of_.clear();
  subscriptions_of_.clear();
}

void FoxgloveClient::Answer() {
  const auto& request = parser_.get();
  const auto origin = request.find(http::field::origin);
  if (!IsUnambiguous(request)) {
    Respond(http::status::bad_request, "one Host and one Origin at most\n");
  } else if (!IsHere(View(request[http::field::host]), host_->port())) {
    Respond(http::status::forbidden, fmt::format("only as ws://127.0.0.1:{}\n", host_->port()));
  } else if (origin != request.end() && !host_->IsOriginAllowed(View(origin->value()))) {
    Respond(http::status::forbidden,
            "not for pages of this origin; poise view --foxglove-origin allows one\n");
  } else if (!websocket::is_upgrade(request)) {
    Respond(
        http::status::upgrade_required,
        fmt::format("open ws://127.0.0.1:{} in Foxglove: \"Open connection\"\n", host_->port()));
  } else if (!IsWebSocketKey(View(request[http::field::sec_websocket_key]))) {
    Respond(http::status::bad_request, "Sec-WebSocket-Key is not 16 bytes in base64\n");
  } else if (!Lists(View(request[http::field::sec_websocket_protocol]), kProtocol)) {
    Respond(http::status::bad_request, fmt::format("the subprotocol must be {}\n", kProtocol));
  } else {
    Upgrade();
  }
}

void FoxgloveClient::Respond(http::status status, std::string text) {
  response_.result(status);
  response_.version(11);
  response_.keep_alive(false);
  response_.set(http::field::content_type, "text/plain; charset=utf-8");
  if (status == http::status::upgrade_required) response_.set(http::field::upgrade, "websocket");
  response_.body() = std::move(text);
  response_.prepare_payload();
  Socket().expires_after(kPatience);
  http::async_write(Socket(), response_, [self = shared_from_this()](ErrorCode, size_t) {
    ErrorCode ignored;
    self->Socket().socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
    self->Close();
  });
}

void FoxgloveClient::Upgrade() {
  Socket().expires_never();  // the stream has times of its own
  websocket::stream_base::timeout times{};
  times.handshake_timeout = kPatience;
  times.idle_timeout = 4 * kPatience;  // pings in between: half-open ones end
  times.keep_alive_pings = true;
  stream_.set_option(times);
  stream_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(http::field::sec_websocket_protocol, kProtocol);
  }));
  stream_.read_message_max(kMaxReceived);
  stream_.auto_fragment(false);
  stream_.async_accept(parser_.get(), [self = shared_from_this()](ErrorCode error) {
    if (error || self->closed_) {
      self->Close();
      return;
    }
    self->streaming_ = true;
    self->buffer_.clear();
    self->Queue({self->host_->server_info(), nullptr, false});
    self->Queue({"", self->host_->advertisement(), false});
    self->Receive();
  });
}

void FoxgloveClient::Receive() {
  if (reading_ || closed_) return;
  reading_ = true;
  stream_.async_read(buffer_, [self = shared_from_this()](ErrorCode error, size_t) {
    self->reading_ = false;
    if (error || self->closed_) {
      self->Close();
      return;
    }
    self->Handle();
    self->buffer_.clear();
    // Who asks more than it takes waits.
    if (self->queue_.size() < kMaxQueue && self->queued_bytes_ < kMaxQueuedBytes) self->Receive();
  });
}

void FoxgloveClient::Handle() {
  if (stream_.got_binary()) {
    Tell(kError, "clients publish nothing here");
    return;
  }
  const auto data = buffer_.cdata();
  const std::string_view text(static_cast<const char*>(data.data()), data.size());
  const Json message = Json::parse(text, nullptr, false);
  if (!message.is_object() || !message.contains("op") || !message["op"].is_string()) {
    Tell(kError, "a message must be a JSON object with an op");
    return;
  }
  const std::string& op = message["op"].get_ref<const std::string&>();
  const bool subscribe = op == "subscribe";
  if (!subscribe && op != "unsubscribe") {
    Tell(kError, "there are the ops subscribe and unsubscribe alone");
    return;
  }
  const char* const name = subscribe ? "subscriptions" : "subscriptionIds";
  const auto list = message.find(name);
  if (list == message.end() || !list->is_array()) {
    Tell(kError,
         fmt::format("{}: {} must be an array", subscribe ? "subscribe" : "unsubscribe", name));
    return;
  }
  for (const Json& item : *list) {
    if (subscribe) {
      const std::optional<size_t> id = NumberOf(item, "id", UINT32_MAX);
      const std::optional<size_t> channel = NumberOf(item, "channelId", UINT32_MAX);
      if (id && channel) {
        HandleSubscribe(*id, *channel);
      } else {
        Tell(kError, "subscribe: id and channelId must be whole numbers");
        return;
      }
    } else if (item.is_number_unsigned() && item.get<uint64_t>() <= UINT32_MAX) {
      const auto known = channel_of_.find(item.get<uint32_t>());
      if (known == channel_of_.end()) continue;
      subscriptions_of_.erase(known->second);
      channel_of_.erase(known);
    }
  }
}

void FoxgloveClient::HandleSubscribe(size_t subscription, size_t channel) {
  // Channels count from 1.
  if (channel < 1 || channel > host_->num_channels()) {
    Tell(kError, fmt::format("subscribe: there is no channel {}", channel));
    return;
  }
  const size_t index = channel - 1;
  const auto id = static_cast<uint32_t>(subscription);
  if (channel_of_.contains(id) || subscriptions_of_.contains(index)) {
    Tell(kError, fmt::format("subscribe: channel {} or id {} has a subscription", channel, id));
    return;
  }
  channel_of_[id] = index;
  subscriptions_of_[index] = id;
  const FoxgloveHost::Kept* const kept = host_->KeptOf(index);
  if (kept != nullptr) QueueMessage(id, kept->time, kept->message);  // never dropped
}

void FoxgloveClient::Tell(int level, std::string_view text) {
  Queue({Json({{"op", "status"}, {"level", level}, {"message", text}}).dump(), nullptr, false});
}

void FoxgloveClient::Send(size_t channel, uint64_t time,
                          const std::shared_ptr<const std::string>& message) {
  const auto subscribed = subscriptions_of_.find(channel);
  if (!streaming_ || subscribed == subscriptions_of_.end()) return;
  const size_t share = host_->HasPrecedence(channel) ? 1 : 2;
  if (queue_.size() >= kMaxQueue / share || queued_bytes_ >= kMaxQueuedBytes / share) {
    ++dropped_;
    return;
  }
  QueueMessage(subscribed->second, time, message);
}

void FoxgloveClient::QueueMessage(uint32_t subscription, uint64_t time,
                                  const std::shared_ptr<const std::string>& message) {
  Outgoing outgoing{"", message, true};
  AddLittleEndian(kMessageData, &outgoing.head);
  AddLittleEndian(subscription, &outgoing.head);
  AddLittleEndian(time, &outgoing.head);
  Queue(std::move(outgoing));
}

void FoxgloveClient::SendTime(uint64_t time) {
  if (!streaming_ || queue_.size() >= kMaxQueue) return;
  Outgoing outgoing{"", nullptr, true};
  AddLittleEndian(kTime, &outgoing.head);
  AddLittleEndian(time, &outgoing.head);
  Queue(std::move(outgoing));
}

void FoxgloveClient::Check() {
  if (!streaming_) return;
  const auto now = Clock::now();
  if (writing_ && now > write_start_ + kPatience) {
    Close();
  } else if (dropped_ != dropped_told_ && now > told_ + kTellAgain && queue_.size() < kMaxQueue) {
    Tell(kWarning, fmt::format("{} messages were dropped: they are not taken fast enough",
                               dropped_ - dropped_told_));
    dropped_told_ = dropped_;
    told_ = now;
  }
}

void FoxgloveClient::Queue(Outgoing outgoing) {
  if (closed_) return;
  queued_bytes_ += outgoing.size();
  queue_.push_back(std::move(outgoing));
  if (!writing_) Write();
}

void FoxgloveClient::Write() {
  writing_ = true;
  write_start_ = Clock::now();
  // Sent bytes live until then, whatever becomes of the queue.
  const auto outgoing = std::make_shared<const Outgoing>(std::move(queue_.front()));
  queue_.pop_front();
  stream_.binary(outgoing->binary);
  const std::array<asio::const_buffer, 2> buffers = {
      asio::buffer(outgoing->head),
      outgoing->message ? asio::buffer(*outgoing->message) : asio::const_buffer()};
  stream_.async_write(buffers, [self = shared_from_this(), outgoing](ErrorCode error, size_t) {
    self->writing_ = false;
    if (error || self->closed_) {
      self->Close();
      return;
    }
    self->queued_bytes_ -= outgoing->size();
    if (!self->queue_.empty()) self->Write();
    if (self->queue_.size() < kMaxQueue / 2 && self->queued_bytes_ < kMaxQueuedBytes / 2) {
      self->Receive();
    }
  });
}

}  // namespace poise
