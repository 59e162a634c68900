#include "tools/cli/terminal.h"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <utility>

#include "fmt/format.h"

namespace poise {

FullScreen::FullScreen() {
  keys_ = isatty(STDIN_FILENO) != 0 && tcgetattr(STDIN_FILENO, &before_) == 0;
  if (keys_) {
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    raw.c_cc[VMIN] = 0;
    raw.c_cc[VTIME] = 0;
    // Ctrl-C ends by a signal that is caught; these would leave the screen as it is.
    raw.c_cc[VSUSP] = _POSIX_VDISABLE;
    raw.c_cc[VQUIT] = _POSIX_VDISABLE;
    tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  }
  Show("\x1b[?1049h\x1b[?25l\x1b[2J");
}

FullScreen::~FullScreen() {
  Show("\x1b[0m\x1b[?25h\x1b[?1049l");
  if (keys_) tcsetattr(STDIN_FILENO, TCSANOW, &before_);
}

FullScreen::Size FullScreen::size() const {
  winsize window{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) != 0 || window.ws_col == 0 || window.ws_row == 0) {
    return {};
  }
  return {window.ws_col, window.ws_row};
}

char FullScreen::Key() {
  pollfd fd{STDIN_FILENO, POLLIN, 0};
  char key = 0;
  const auto next = [&] { return poll(&fd, 1, 0) > 0 && read(STDIN_FILENO, &key, 1) == 1; };
  if (!keys_ || !next()) return 0;
  if (key != '\x1b' || !next() || (key != '[' && key != 'O')) return key;
  std::string sequence;
  while (next()) {
    sequence += key;
    if (key >= '@' && key <= '~') break;  // its last byte
  }
  constexpr std::pair<const char*, char> kKeys[] = {
      {"A", 'k'},  {"B", 'j'}, {"C", 'l'}, {"D", 'h'},  {"5~", 'b'},
      {"6~", 'f'}, {"H", 'g'}, {"F", 'G'}, {"1~", 'g'}, {"4~", 'G'}};
  for (const auto& [name, meaning] : kKeys) {
    if (sequence == name) return meaning;
  }
  return 0;
}

bool FullScreen::Show(const std::string& frame) {
  return std::fwrite(frame.data(), 1, frame.size(), stdout) == frame.size() &&
         std::fflush(stdout) == 0;
}

}  // namespace poise
