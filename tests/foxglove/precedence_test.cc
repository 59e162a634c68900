// What waits for a client that takes too little.
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "fmt/format.h"
#include "gtest/gtest.h"
#include "tools/foxglove/foxglove_server.h"

namespace poise {
namespace {

namespace asio = boost::asio;
using std::chrono::steady_clock;

constexpr size_t kScene = 0, kBus = 1;  // topics
constexpr int kPictures = 5, kFlood = 1'000;

/// A client's frame of RFC 6455, whose mask is 0; below 126 bytes.
std::string ClientFrame(const std::string& text) {
  return std::string{'\x81', static_cast<char>(0x80 | text.size())} + std::string(4, '\0') + text;
}

class FoxgloveQueue : public testing::Test {
 protected:
  FoxgloveQueue()
      : server_(0, "test", {{"/tf", "json", "", "", ""}, {"ROBOT_STATE", "json", "", "", ""}}, {}),
        socket_(io_) {
    socket_.connect({asio::ip::address_v4::loopback(), static_cast<uint16_t>(server_.port())});
    Write(fmt::format(
        "GET / HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\n",
        server_.port()));
    socket_.non_blocking(true);
    PollUntil([this] { return Received().find("advertise") != std::string::npos; });
    Write(ClientFrame(R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":1},)"
                      R"({"id":1,"channelId":2}]})"));
    PollUntil([this] { return server_.Wants(kScene) && server_.Wants(kBus); });
  }

  void Write(const std::string& bytes) { asio::write(socket_, asio::buffer(bytes)); }

  /// All that has come.
  const std::string& Received() {
    char bytes[65'536];
    boost::system::error_code error;
    while (const size_t size = socket_.read_some(asio::buffer(bytes), error)) {
      received_.append(bytes, size);
    }
    return received_;
  }

  void PollUntil(const std::function<bool()>& condition) {
    const auto end = steady_clock::now() + std::chrono::seconds(60);
    while (!condition()) {
      ASSERT_LT(steady_clock::now(), end);
      server_.Poll();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  FoxgloveServer server_;
  asio::io_context io_;
  asio::ip::tcp::socket socket_;
  std::string received_;
};

/// Messages of the bus, large or many, leave room for pictures, which come whole and in order.
TEST_F(FoxgloveQueue, TheBusLeavesRoomForPictures) {
  for (const size_t size : {size_t{100'000}, size_t{10}}) {
    const int64_t before = server_.dropped();
    for (int i = 0; i < kFlood; ++i) server_.Send(kBus, 0, std::string(size, 'b'));
    const int64_t dropped = server_.dropped();
    EXPECT_GT(dropped, before);
    for (int i = 0; i < kPictures; ++i) {
      server_.Send(kScene, 0, fmt::format("[picture {} after {}]", i, size));
    }
    EXPECT_EQ(server_.dropped(), dropped);
    size_t at = 0;
    for (int i = 0; i < kPictures; ++i) {
      const std::string picture = fmt::format("[picture {} after {}]", i, size);
      PollUntil([&] { return Received().find(picture, at) != std::string::npos; });
      at = received_.find(picture, at);
    }
  }
}

/// Pictures alone are bounded as well.
TEST_F(FoxgloveQueue, PicturesAreBounded) {
  for (int i = 0; i < kFlood; ++i) server_.Send(kScene, 0, "picture");
  EXPECT_GT(server_.dropped(), 0);
  EXPECT_LT(server_.dropped(), kFlood);
}

}  // namespace
}  // namespace poise
