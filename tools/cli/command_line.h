// What CLI11 needs beside it: help, checks of what a command line says, and what is wrong with it.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace poise {

/// Lays out the help: an option's meaning comes before what it goes with. The root takes it before
/// its commands are added, which take it over.
std::shared_ptr<CLI::FormatterBase> MakeHelpFormatter();

/// The footer of a command that says nothing else there: exit codes, and an example of its use.
void SetExample(CLI::App* command, const std::string& example);

/// An option that may be given again and again, one value each time. `type`: what the help calls
/// it.
CLI::Option* AddList(CLI::App* command, const char* flag, std::vector<std::string>* to,
                     const char* text, const char* type = "TEXT");

/// "TEXT: must be RANGE" for what is no number or not `good`; NaN never is. For CLI::Option::check.
std::function<std::string(const std::string&)> Within(const char* range, bool (*good)(double));

/// "TEXT: must be a whole number ..." for what is none from 0 to 2^64 - 1. For CLI::Option::check,
/// since the parser alone takes -1 and more digits for the largest.
std::function<std::string(const std::string&)> Whole();

/// The help of the command that was asked about, in the terminal's width.
std::string HelpText(const CLI::App& app);

/// True when a command that only has subcommands was called without one, and nothing else is wrong.
bool WantsSubcommand(const CLI::App& app, const CLI::ParseError& error);

/// What is wrong, what was meant, and whose help says more, in one line without "poise: ".
std::string UsageProblem(const CLI::App& app, const CLI::ParseError& error);

}  // namespace poise
