#include "text.hpp"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

#include "errors.hpp"

namespace icp2d {

std::string read_text(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream || std::filesystem::is_directory(file)) throw InputError(file, "cannot be read");
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::vector<std::string> read_lines(const std::filesystem::path& file) {
    std::istringstream text(read_text(file));
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) {
        if (!line.empty() && line.back() == '\r') line.pop_back();
        lines.push_back(std::move(line));
    }
    return lines;
}

std::optional<double> to_number(const std::string& text) {
    // strtod alone would take blanks, hexadecimal numbers, "nan" and "inf".
    if (text.empty() || text.find_first_not_of("0123456789+-.eE") != std::string::npos) {
        return std::nullopt;
    }
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (end != text.c_str() + text.size() || !std::isfinite(value)) return std::nullopt;
    return value;
}

std::string shown(std::string_view text) {
    constexpr std::size_t longest = 40;
    std::string quoted = "'";
    for (const char c : text.substr(0, longest)) quoted += ' ' <= c && c <= '~' ? c : '?';
    return quoted + (text.size() > longest ? "…'" : "'");
}

}  // namespace icp2d
