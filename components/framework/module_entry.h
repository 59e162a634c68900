// The entry of a module of users' own: see modules.h.
#pragma once

#include "components/framework/modules.h"
#include "poise_commit.h"

/// Once a module: POISE_MODULE { poise::AddComponent(...); poise::logging::AddMetric(...); }
/// Messages of poise_messages() and schemas of PROTOS need no mention. The commit says which Poise
/// it was built against.
#define POISE_MODULE                                                 \
  extern "C" __attribute__((used)) const char poise_module_build[] = \
      "poise-module-build:" POISE_COMMIT;                            \
  extern "C" void poise_module()

extern "C" void poise_module();
