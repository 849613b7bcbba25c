#include <array>
#include <cmath>
#include <cstdio>

#include "json.hpp"

namespace icp2d {

std::string to_json(double value) {
    if (!std::isfinite(value)) return "null";
    std::array<char, 32> digits{};
    std::snprintf(digits.data(), digits.size(), "%.17g", value);
    return digits.data();
}

std::string to_json(Eigen::Index count) {
    return std::to_string(count);
}

std::string to_json(std::string_view text) {
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') quoted += '\\';
        quoted += 0 <= c && c < ' ' ? ' ' : c;
    }
    return quoted + '"';
}

std::string to_json(const Pose& pose) {
    return "[" + to_json(pose.x) + ", " + to_json(pose.y) + ", " + to_json(pose.theta) + "]";
}

std::string to_json(const std::vector<Pose>& poses) {
    std::string list;
    for (const Pose& pose : poses) list += (list.empty() ? "" : ", ") + to_json(pose);
    return "[" + list + "]";
}

std::string to_json(const std::optional<double>& value) {
    return value ? to_json(*value) : "null";
}

}  // namespace icp2d
