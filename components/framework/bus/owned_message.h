// A message object of a port's type.
#pragma once

#include "components/framework/ports.h"

namespace poise {

class OwnedMessage {
 public:
  explicit OwnedMessage(const InputPort* port) : port_(port), message_(port->NewMessage()) {}
  OwnedMessage(OwnedMessage&& other) noexcept : port_(other.port_), message_(other.message_) {
    other.message_ = nullptr;
  }
  OwnedMessage& operator=(OwnedMessage&&) = delete;
  ~OwnedMessage() {
    if (message_ != nullptr) port_->DeleteMessage(message_);
  }
  void* get() const { return message_; }

 private:
  const InputPort* port_;
  void* message_;
};

}  // namespace poise
