// What a caller can do wrong. What the data do is a result, never one of these.

#pragma once

#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace icp2d {

/// A command line that is none.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A file that cannot be read or believed: "FILE: …" or "FILE:LINE: …".
struct InputError : std::runtime_error {
    InputError(const std::filesystem::path& file, const std::string& what)
        : std::runtime_error(file.string() + ": " + what) {}
    InputError(const std::filesystem::path& file, std::size_t line, const std::string& what)
        : std::runtime_error(file.string() + ":" + std::to_string(line) + ": " + what) {}
};

}  // namespace icp2d
