#include "components/framework/bus/outbox.h"

#include "components/framework/run.h"

namespace poise {

Outbox::Outbox(OutputPort* port, size_t component, int channel, std::string channel_name,
               RunSender sender, bool awaited)
    : port_(port),
      component_(component),
      channel_(channel),
      awaited_(awaited),
      channel_name_(std::move(channel_name)),
      sender_(sender),
      size_(static_cast<size_t>(port->encoded_size())),
      bytes_(size_ * kSentHistory),
      ticks_(kSentHistory, -1) {}

bool Outbox::Send(int64_t tick) {
  const auto slot = static_cast<size_t>(tick % kSentHistory);
  uint8_t* const data = bytes_.data() + slot * size_;
  const int encoded = port_->Encode(data, static_cast<int>(size_));
  ticks_[slot] = encoded == static_cast<int>(size_) ? tick : -1;
  return ticks_[slot] == tick && sender_.Send(channel_name_, data, size_);
}

bool Outbox::Resend(int64_t tick) {
  if (tick < 0) return false;
  const auto slot = static_cast<size_t>(tick % kSentHistory);
  return ticks_[slot] == tick && sender_.Send(channel_name_, bytes_.data() + slot * size_, size_);
}

}  // namespace poise
