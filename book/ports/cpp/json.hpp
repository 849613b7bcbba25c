// As much JSON as the commands speak: they read flat objects of numbers, and write answers.

#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "se2.hpp"

namespace icp2d {

/// One "key": number or "key": null of a file.
struct JsonMember {
    std::string key;
    std::optional<double> value;  // none for null
    std::size_t line;
};

/// Reads one flat object; throws InputError for anything else. No key comes twice.
std::vector<JsonMember> read_flat_json(const std::filesystem::path& file);

// Values as JSON. Numbers carry 17 significant digits; what has no number is null.
std::string to_json(double value);
std::string to_json(Eigen::Index count);
std::string to_json(std::string_view text);
std::string to_json(const Pose& pose);  // [x, y, theta]
std::string to_json(const std::vector<Pose>& poses);
std::string to_json(const std::optional<double>& value);

/// An object that is written member by member.
class JsonObject {
public:
    template <typename Value>
    JsonObject& add(std::string_view key, const Value& value) {
        if (!members_.empty()) members_ += ", ";
        members_ += to_json(key) + ": " + to_json(value);
        return *this;
    }
    std::string str() const { return "{" + members_ + "}"; }

private:
    std::string members_;
};

}  // namespace icp2d
