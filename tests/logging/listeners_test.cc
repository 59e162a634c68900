#include "logging/recording/listeners.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

#include "components/framework/bus/udp_bus.h"

namespace poise::logging {
namespace {

// A port that nobody has, from the kernel.
int FreePort() {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  socklen_t size = sizeof address;
  EXPECT_EQ(bind(fd, reinterpret_cast<sockaddr*>(&address), size), 0);
  EXPECT_EQ(getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size), 0);
  close(fd);
  return ntohs(address.sin_port);
}

TEST(AnyoneListens, SeesASocketComeAndGo) {
  const std::string url = "udpm://239.255.76.67:" + std::to_string(FreePort()) + "?ttl=0";
  EXPECT_FALSE(AnyoneListens(url));
  const BusSender sender(url);
  EXPECT_FALSE(AnyoneListens(url)) << "who sends does not listen";
  {
    const BusReceiver receiver(url);
    EXPECT_TRUE(AnyoneListens(url));
  }
  EXPECT_FALSE(AnyoneListens(url));
}

TEST(AnyoneListens, TakesTheUnknownForAListener) {
  EXPECT_TRUE(AnyoneListens("udpm://239.255.76.67:1?ttl=1")) << "another machine may";
  EXPECT_TRUE(AnyoneListens("udpm://239.255.76.67:1?ttl=0", "/nonexistent"));
  EXPECT_TRUE(AnyoneListens("udpm://239.255.76.67:1?ttl=0", "/dev/null"));
}

}  // namespace
}  // namespace poise::logging
