// A terminal used as a full screen.
#pragma once

#include <termios.h>

#include <string>

namespace poise {

/// While it lives: the terminal's second screen without cursor, and keys unechoed, one at a time.
/// The destructor restores everything. At most one, on stdin and stdout.
class FullScreen {
 public:
  FullScreen();
  ~FullScreen();
  FullScreen(const FullScreen&) = delete;
  FullScreen& operator=(const FullScreen&) = delete;

  struct Size {
    int columns = 80;
    int rows = 24;
  };
  Size size() const;
  /// The next key pressed, 0 for none; does not wait. Arrows are h, j, k and l, a page up or down b
  /// and f, home and end g and G.
  char Key();
  /// False when the terminal has gone.
  bool Show(const std::string& frame);

 private:
  bool keys_ = false;  // stdin is a terminal
  termios before_{};
};

}  // namespace poise
