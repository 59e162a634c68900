// Acts as another user of this machine, where the tests may.
#pragma once

#include <grp.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>

namespace poise {

/// True when tests run as root, who alone can become somebody else.
inline bool CanBeNobody() { return geteuid() == 0; }

/// Runs `act` in a process of its own, of user nobody if `nobody`; returns its number.
inline pid_t StartAs(bool nobody, const std::function<int()>& act) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  constexpr uid_t kNobody = 65534;
  if (nobody && (setgroups(0, nullptr) != 0 || setgid(kNobody) != 0 || setuid(kNobody) != 0)) {
    _exit(111);
  }
  _exit(act());
}
inline int ExitCodeOf(pid_t pid) {
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace poise
