// Serves the page of a run in progress and its ticks to browsers on this machine.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "tools/live/tick_ring.h"

namespace poise {

/// What lets pages act.
struct ViewControl {
  /// Required of the page's address and of the stream's; empty: pages only look.
  std::string token;
  /// Takes a text of a page; false: it is none of ours and is dropped.
  std::function<bool(std::string_view text)> receive;
};

/// HTTP on 127.0.0.1: GET / is the page, /stream a WebSocket (docs/reference/report_format.md).
/// Requests that name another host or come from another origin are refused, and with a token those
/// without it. All that is received is bounded in size, rate and time, and so is what waits to be
/// sent: one batch a client; who takes none for 5 s is dropped. A page that streams keeps its place
/// whoever else connects. Runs on the caller's thread, no error of a client throws.
class ViewServer {
 public:
  /// `port` 0: a free one. `ring` must outlive the server. Throws ConfigError when the port cannot
  /// be had.
  ViewServer(int port, std::string page, const TickRing* ring, ViewControl control = {});
  ~ViewServer();

  int port() const;
  /// "http://127.0.0.1:PORT/", with the token if there is one.
  std::string url() const;
  /// Sends, receives and accepts for this long.
  void RunFor(std::chrono::milliseconds duration);
  /// Sends each client the ticks that it lacks. To be called at the rate of the pictures.
  void SendTicks();
  /// What every client is told first, and again when it changes.
  void SetState(std::string json);
  /// A further text for every client, likewise; none until it is set.
  void SetStatus(std::string json);
  /// A third text for every client: what pages may do and have done.
  void SetControl(std::string json);
  /// The ring's ticks are others than before, from its first on: all clients get them.
  void Restart();
  /// Clients that took nothing for too long.
  int64_t dropped() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace poise
