// Text as it comes: whole files, lines, numbers.

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace icp2d {

/// The content of a file; throws InputError where it cannot be read.
std::string read_text(const std::filesystem::path& file);

/// The lines of a file, without their ends; what follows the last line end only if not empty.
std::vector<std::string> read_lines(const std::filesystem::path& file);

/// The whole text as one finite decimal number, or nothing.
std::optional<double> to_number(const std::string& text);

/// Text in quotes, safe to show on one line of a message.
std::string shown(std::string_view text);

}  // namespace icp2d
