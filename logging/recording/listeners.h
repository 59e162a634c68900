// Who listens to a URL of the bus.
#pragma once

#include <string>
#include <string_view>

namespace poise::logging {

/// Whether anyone may hear what is sent to "udpm://GROUP:PORT?ttl=TTL". With a TTL of 0 only this
/// machine (network namespace) does, and whoever does has a UDP socket on PORT in `table`, which is
/// in the form of /proc/net/udp. True also when the table cannot be read.
bool AnyoneListens(std::string_view url, const std::string& table = "/proc/net/udp");

}  // namespace poise::logging
