#include "settings.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string_view>

#include "errors.hpp"
#include "json.hpp"
#include "text.hpp"

namespace icp2d {
namespace {

Eigen::Index to_count(double value) {
    if (value != std::floor(value)) {
        throw std::invalid_argument("`max_iterations` must be a whole number, got " +
                                    to_json(value));
    }
    constexpr double endless = 1e15;  // an integer still holds it, and no run gets there
    return static_cast<Eigen::Index>(std::clamp(value, -endless, endless));
}

struct Key {
    std::string_view name;
    void (*set)(Settings& settings, double value);
    bool can_be_off = false;  // null turns it off: infinity
};

constexpr Key keys[] = {
    {"initial_x", [](Settings& s, double value) { s.initial.x = value; }},
    {"initial_y", [](Settings& s, double value) { s.initial.y = value; }},
    {"initial_theta", [](Settings& s, double value) { s.initial.theta = value; }},
    {"max_correspondence_distance",
     [](Settings& s, double value) { s.icp.max_correspondence_distance = value; }, true},
    {"overlap_ratio", [](Settings& s, double value) { s.icp.overlap_ratio = value; }},
    {"huber_delta", [](Settings& s, double value) { s.icp.huber_delta = value; }, true},
    {"max_iterations", [](Settings& s, double value) { s.icp.max_iterations = to_count(value); }},
    {"translation_tolerance",
     [](Settings& s, double value) { s.icp.translation_tolerance = value; }},
    {"rotation_tolerance", [](Settings& s, double value) { s.icp.rotation_tolerance = value; }},
    {"cost_tolerance", [](Settings& s, double value) { s.icp.cost_tolerance = value; }},
};

std::string known_keys() {
    std::string list;
    for (const Key& key : keys) list.append(list.empty() ? "" : ", ").append(key.name);
    return list;
}

void assign(Settings& settings, const JsonMember& member) {
    const auto key = std::find_if(std::begin(keys), std::end(keys),
                                  [&](const Key& known) { return known.name == member.key; });
    if (key == std::end(keys)) {
        throw std::invalid_argument("unknown key " + shown(member.key) + "; known are " +
                                    known_keys());
    }
    if (!member.value && !key->can_be_off) {
        throw std::invalid_argument("`" + member.key + "` must be a number, got null");
    }
    key->set(settings, member.value.value_or(std::numeric_limits<double>::infinity()));
    require_valid(settings.icp);
}

}  // namespace

Settings read_settings(const std::filesystem::path& file) {
    Settings settings;
    for (const JsonMember& member : read_flat_json(file)) {
        try {
            assign(settings, member);
        } catch (const std::invalid_argument& error) {
            throw InputError(file, member.line, error.what());
        }
    }
    return settings;
}

}  // namespace icp2d
