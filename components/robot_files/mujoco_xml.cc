#include "components/robot_files/mujoco_xml.h"

#include <cstring>
#include <mutex>
#include <stdexcept>

namespace poise::robot {
namespace {

// MuJoCo goes on with whatever was wrong when this returns: throwing through it is the only way to
// stop.
void ThrowError(const char* text) { throw std::runtime_error(text); }
void IgnoreWarning(const char*) {}

// The global handlers are a simulator's where one runs in this process: it finds them as it left
// them.
class ErrorHandlers {
 public:
  ErrorHandlers() : error_(mju_user_error), warning_(mju_user_warning) {
    mju_user_error = ThrowError;
    mju_user_warning = IgnoreWarning;
  }
  ~ErrorHandlers() {
    mju_user_error = error_;
    mju_user_warning = warning_;
  }

 private:
  void (*error_)(const char*);
  void (*warning_)(const char*);
};

}  // namespace

MujocoModel CompileMjcf(const std::string& xml, std::string* problem) {
  static std::mutex one_at_a_time;  // MuJoCo keeps the last XML for the process
  const std::lock_guard lock(one_at_a_time);
  const ErrorHandlers handlers;
  constexpr char kName[] = "robot.xml";
  const auto vfs = std::make_unique<mjVFS>();  // some megabytes
  mj_defaultVFS(vfs.get());
  mj_makeEmptyFileVFS(vfs.get(), kName, static_cast<int>(xml.size()));
  std::memcpy(vfs->filedata[mj_findFileVFS(vfs.get(), kName)], xml.data(), xml.size());
  char error[500] = "";
  MujocoModel model;
  try {
    model.reset(mj_loadXML(kName, vfs.get(), error, sizeof error));
    *problem = error;
  } catch (const std::exception& thrown) {
    *problem = thrown.what();
  }
  mj_deleteVFS(vfs.get());
  mj_freeLastXML();
  return model;
}

}  // namespace poise::robot
