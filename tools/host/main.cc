// The program that runs components which share a process: all types that this build knows.
#include "components/framework/runners/component_main.h"
#include "tools/scenario/registry.h"

int main(int argc, char** argv) { return poise::HostMain(argc, argv, poise::Components()); }
