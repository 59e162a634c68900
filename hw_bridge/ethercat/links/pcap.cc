#include "hw_bridge/ethercat/links/pcap.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "hw_bridge/ethercat/links/bytes.h"
#include "hw_bridge/ethercat/links/frame.h"

namespace poise::ethercat {
namespace {

constexpr size_t kEthernetHeader = 14, kMinEthernet = 60, kIpHeader = 20, kUdpHeader = 8;

void PutBigEndian16(std::span<uint8_t> bytes, size_t offset, size_t value) {
  bytes[offset] = static_cast<uint8_t>(value >> 8);
  bytes[offset + 1] = static_cast<uint8_t>(value);
}

/// IPv4 and UDP headers between two loopback-like addresses; the UDP checksum is left out (0).
void PutIpUdp(std::span<uint8_t> packet, size_t payload, bool to_slaves) {
  packet[0] = 0x45;
  PutBigEndian16(packet, 2, kIpHeader + kUdpHeader + payload);
  packet[8] = 64;  // time to live
  packet[9] = 17;  // UDP
  for (size_t i : {12, 16}) {
    packet[i] = 127;
    packet[i + 3] = 1;
  }
  uint32_t sum = 0;
  for (size_t i = 0; i < kIpHeader; i += 2) sum += uint32_t{packet[i]} << 8 | packet[i + 1];
  while (sum >> 16 != 0) sum = (sum & 0xFFFF) + (sum >> 16);
  PutBigEndian16(packet, 10, ~sum & 0xFFFF);
  constexpr uint16_t kMasterPort = 49152;  // any other than the slaves'
  PutBigEndian16(packet, kIpHeader, to_slaves ? kMasterPort : kUdpPort);
  PutBigEndian16(packet, kIpHeader + 2, to_slaves ? kUdpPort : kMasterPort);
  PutBigEndian16(packet, kIpHeader + 4, kUdpHeader + payload);
}

}  // namespace

CaptureLink::CaptureLink(std::unique_ptr<Link> link, const std::string& path, Carrier carrier)
    : link_(std::move(link)), path_(path), file_(path, std::ios::binary), carrier_(carrier) {
  Check();
  std::array<uint8_t, 24> header{};
  Put<uint32_t>(header, 0, 0xA1B23C4D);  // nanosecond time stamps
  Put<uint16_t>(header, 4, 2);           // version 2.4
  Put<uint16_t>(header, 6, 4);
  Put<uint32_t>(header, 16, 65535);  // longest packet
  Put<uint32_t>(header, 20, 1);      // Ethernet
  file_.write(reinterpret_cast<const char*>(header.data()), header.size());
}

void CaptureLink::Write(std::span<const uint8_t> frame, bool to_slaves) {
  const int64_t time = link_->Now();
  const bool udp = carrier_ == Carrier::kUdp;
  const size_t headers = kEthernetHeader + (udp ? kIpHeader + kUdpHeader : 0);
  std::vector<uint8_t> packet(std::max(headers + frame.size(), kMinEthernet), 0);
  std::fill_n(packet.begin(), 6, uint8_t{0xFF});
  packet[6] = to_slaves ? 0x00 : 0x02;
  packet[11] = 1;
  PutBigEndian16(packet, 12, udp ? 0x0800 : kEtherType);
  if (udp) PutIpUdp(std::span(packet).subspan(kEthernetHeader), frame.size(), to_slaves);
  std::copy(frame.begin(), frame.end(), packet.begin() + static_cast<std::ptrdiff_t>(headers));

  std::array<uint8_t, 16> header{};
  Put<uint32_t>(header, 0, static_cast<uint32_t>(time / kSecond));
  Put<uint32_t>(header, 4, static_cast<uint32_t>(time % kSecond));
  Put<uint32_t>(header, 8, static_cast<uint32_t>(packet.size()));
  Put<uint32_t>(header, 12, static_cast<uint32_t>(packet.size()));
  file_.write(reinterpret_cast<const char*>(header.data()), header.size());
  file_.write(reinterpret_cast<const char*>(packet.data()),
              static_cast<std::streamsize>(packet.size()));
}

void CaptureLink::Close() {
  file_.close();
  Check();
}

void CaptureLink::Check() const {
  if (!file_) throw EthercatError("cannot write the capture {}: {}", path_, std::strerror(errno));
}

bool CaptureLink::Send(std::span<const uint8_t> frame) {
  Write(frame, true);
  return link_->Send(frame);
}

size_t CaptureLink::Receive(std::span<uint8_t> frame, int64_t deadline) {
  const size_t size = link_->Receive(frame, deadline);
  if (size > 0) Write(frame.first(size), false);
  return size;
}

}  // namespace poise::ethercat
