// The commands of the program, each of which answers one line of JSON.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace icp2d {

/// Answers one command; its relative paths are relative to `folder`.
///
/// Throws UsageError for words that are no command, InputError for a file that is at fault.
std::string answer(const std::vector<std::string>& words, const std::filesystem::path& folder);

}  // namespace icp2d
